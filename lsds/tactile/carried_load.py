"""The load that a grip carries, over time: the mean over the fingers, since the grip began; force and torque together,
as a force (`lsds.tactile.soft_finger`)."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from statistics import fmean, median
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.tactile.soft_finger import pull_of

if TYPE_CHECKING:
    from lsds.contracts import ContactLoad, FingerCycle

REMEMBERED_S = 1.0
"""The load to be carried is the greatest of this time: an arm that brakes lightens it for a moment only."""
ZERO_S = 0.3
"""A finger that is first seen later than this after the first has no zero: it may be under load already."""
LEAST_N = 0.03
"""A smaller load tells nothing of friction: noise and creep of the gel are as large."""
MEDIAN = 3
"""A finger's frames whose median counts where one alone might be wrong."""


class CarriedLoad:
    """`now_n` is the newest load a finger, NaN where none is known; `stale` whether a finger's is an earlier one,
    because it tells none now. `normal_n` is the greatest normal force of a finger, NaN where none is told."""

    def __init__(self) -> None:
        self.now_n = self.normal_n = math.nan
        self.stale = False
        self._began_ns: int | None = None
        self._zero: dict[str, ContactLoad] = {}
        self._last: dict[str, deque[float]] = {}
        self._seen_ns: dict[str, int] = {}
        self._loads: deque[tuple[int, float]] = deque()

    def take(self, t_ns: int, fingers: Sequence[FingerCycle]) -> None:
        """Take what the fingers see at a time. A frame that was taken before is not taken again."""
        told = set()
        normals = []
        for finger in fingers:
            load = finger.observation.load
            if load is None:
                continue
            told.add(finger.finger)
            normals.append(load.normal_n)
            if self._seen_ns.get(finger.finger) != finger.observation.t_ns:
                self._seen_ns[finger.finger] = finger.observation.t_ns
                self._take(finger.finger, load, t_ns)
        self.normal_n = max(filter(math.isfinite, normals), default=math.nan)
        self.stale = not self._last.keys() <= told
        if not self._last:
            return
        self.now_n = fmean(loads[-1] for loads in self._last.values())
        self._loads.append((t_ns, fmean(median(loads) for loads in self._last.values())))
        while t_ns - self._loads[0][0] > nanoseconds(REMEMBERED_S):
            self._loads.popleft()

    @property
    def greatest_n(self) -> float:
        """The greatest load of late; one frame alone does not count."""
        return max((load for _, load in self._loads), default=math.nan)

    def _take(self, name: str, load: ContactLoad, t_ns: int) -> None:
        self._began_ns = t_ns if self._began_ns is None else self._began_ns
        if name not in self._zero:
            if t_ns - self._began_ns > nanoseconds(ZERO_S):
                return
            self._zero[name] = load
        self._last.setdefault(name, deque(maxlen=MEDIAN)).append(pull_of(load.since(self._zero[name])))
