"""The load that a grip carries since it began: the mean over the fingers, in N.

Force and torque are combined into one equivalent force (`lsds.tactile.contact_load`).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from statistics import fmean, median
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.tactile.contact_load import pull_of
from lsds.tactile.contact_size import reach_of

if TYPE_CHECKING:
    from lsds.contracts import ContactLoad, FingerCycle

REMEMBERED_S = 1.0
"""Time over which the maximum load is kept, s: a braking arm reduces the load only briefly."""
ZERO_S = 0.3
"""Latest first load of a finger after the grip began, s. A later one may be that of a loaded finger: it has no zero."""
LEAST_EVIDENCE_N = 0.03
"""Minimum load that is evidence of friction, N: noise and creep of the gel reach this value."""
MEDIAN_FRAMES = 3
"""Number of frames whose median load, or normal force, counts: one frame alone may be wrong."""
GREATEST_FRICTION = 2.2
"""Maximum ratio of the load of a finger to its normal force: the random objects have a friction of up to 1.1, and the
normal force by the imprint of a gel that is not calibrated may be half of the true one."""


class CarriedLoad:
    """`now_n` is the newest load per finger, `greatest_n` the maximum of the last `REMEMBERED_S`, of medians that
    suppress single frames; N, NaN if unknown.

    `reach_m` is the least reach of a finger's contact along its load (`reach_of`), NaN if unknown.
    `stale` is true if some finger measures no load now, so that its last one is used, and `fresh` if some finger does
    measure one. `normals_n` are the normal forces by finger and `normal_n` is the greatest, NaN if they are empty. An
    estimate that could not carry the load is left out, as that of a bump of a smooth face; `doubted` is true then.
    """

    def __init__(self) -> None:
        self.now_n = self.greatest_n = self.normal_n = self.reach_m = math.nan
        self.stale = self.fresh = self.doubted = False
        self.normals_n: dict[str, float] = {}
        self._began_ns: int | None = None
        self._zero: dict[str, ContactLoad] = {}
        self._reach_m: dict[str, float] = {}
        self._last: dict[str, deque[float]] = {}
        self._seen_ns: dict[str, int] = {}
        self._loads: deque[tuple[int, float]] = deque()

    def take(self, t_ns: int, fingers: Sequence[FingerCycle]) -> None:
        """Take the fingers' observations at a time. Repeated frames are ignored."""
        self._began_ns = t_ns if self._began_ns is None else self._began_ns
        measured = set()
        normals: dict[str, float] = {}
        for finger in fingers:
            load = finger.observation.load
            if load is None or not math.isfinite(sum(load.shear_n) + load.torque_nm):
                continue
            measured.add(finger.finger)
            normals[finger.finger] = load.normal_n
            if self._seen_ns.get(finger.finger) != finger.observation.t_ns:
                self._seen_ns[finger.finger] = finger.observation.t_ns
                self._take(finger, load, t_ns)
        self.reach_m = min(filter(math.isfinite, self._reach_m.values()), default=math.nan)
        known = {name: normal_n for name, normal_n in normals.items() if 0 < normal_n < math.inf}
        self.normals_n = {
            name: normal_n
            for name, normal_n in known.items()
            if not normal_n * GREATEST_FRICTION < median(self._last.get(name, (0.0,)))
        }
        self.doubted = len(self.normals_n) < len(known)
        self.normal_n = max(self.normals_n.values(), default=math.nan)
        self.stale, self.fresh = not self._last.keys() <= measured, bool(self._last.keys() & measured)
        if not self._last:
            return
        self.now_n = fmean([loads[-1] for loads in self._last.values()])
        settled_n = fmean([median(loads) for loads in self._last.values()])
        if not math.isfinite(settled_n):
            return
        # Only loads that no later one exceeds can become the greatest.
        while self._loads and self._loads[-1][1] <= settled_n:
            self._loads.pop()
        self._loads.append((t_ns, settled_n))
        while t_ns - self._loads[0][0] > nanoseconds(REMEMBERED_S):
            self._loads.popleft()
        self.greatest_n = self._loads[0][1]

    def _take(self, finger: FingerCycle, load: ContactLoad, t_ns: int) -> None:
        name = finger.finger
        if name not in self._zero:
            if self._began_ns is not None and t_ns - self._began_ns > nanoseconds(ZERO_S):
                return
            self._zero[name] = load
        carried = load.since(self._zero[name])
        self._last.setdefault(name, deque(maxlen=MEDIAN_FRAMES)).append(pull_of(carried))
        self._reach_m[name] = reach_of(finger.observation.contact, carried.shear_n)
