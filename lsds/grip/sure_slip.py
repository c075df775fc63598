"""A slip of which the estimator is sure: a smooth slide does not tremble, and detectors may miss it."""

from __future__ import annotations

import math
from collections import deque
from statistics import fmean
from typing import TYPE_CHECKING, NamedTuple

from lsds.clock import nanoseconds
from lsds.grip.rounds import Rounds
from lsds.grip.soft_finger import ARM_M, speed_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds.contracts import FingerCycle, SlipEstimate

SEEN_M_S, SURE, SURE_S = 0.005, 2.0, 0.03
"""An estimate that is above this speed by so many standard deviations, for so long and in two rounds, is a slip."""
LONG_S, SLID_M_S = 0.4, 0.003
"""A mean velocity over so long that is above this by as many standard deviations is one as well: what is in doubt in
every frame is not in doubt over ten of them."""
SHARED = 0.5
"""Standard deviation of such a mean over that of a frame. Frames within one window of an estimator share their errors:
ten of them are worth four."""


class _Seen(NamedTuple):
    t_ns: int
    x_m_s: float
    y_m_s: float
    turn_m_s: float
    std_m_s: float


class SureSlip:
    """Tells from the estimates of one grip whether it slips for certain."""

    def __init__(self) -> None:
        self._recent: deque[_Seen] = deque()
        self._since_ns: int | None = None
        self._rounds, self._since_then = Rounds(), Rounds()
        self._again = False

    def forget(self) -> None:
        """Forget the mean: what was seen before the fingers close says nothing of what follows."""
        self._recent.clear()

    def see(self, t_ns: int, estimate: SlipEstimate, fingers: Sequence[FingerCycle] = ()) -> bool:
        """Take the estimate of a frame, which is that of all fingers; return whether it slips."""
        speed, std = speed_of(estimate)
        if estimate.abstained or not math.isfinite(std):
            self._recent.clear()
            self._since_ns = None
            return False
        if self._rounds.completes(fingers):
            turn = estimate.angular_rad_s if math.isfinite(estimate.angular_rad_s) else 0.0
            self._recent.append(_Seen(t_ns, *estimate.velocity_m_s, ARM_M * turn, std))
        while self._recent and t_ns - self._recent[0].t_ns > nanoseconds(LONG_S):
            self._recent.popleft()
        if not speed - SURE * std > SEEN_M_S:
            self._since_ns = None
            return self._has_slid()
        if self._since_ns is None:
            self._since_ns, self._again = t_ns, False
            self._since_then.restart(fingers)
            return False
        self._again |= self._since_then.completes(fingers)
        return self._again and t_ns - self._since_ns >= nanoseconds(SURE_S)

    def _has_slid(self) -> bool:
        """Tell whether the velocities of a longer time are certain together.

        They are added with their directions: at rest they cancel, while the speed, which has none, never does.
        """
        if not self._recent or self._recent[-1].t_ns - self._recent[0].t_ns < nanoseconds(0.8 * LONG_S):
            return False
        _, x, y, turn, std = (fmean(each) for each in zip(*self._recent, strict=True))
        return math.hypot(x, y) + abs(turn) - SURE * SHARED * std > SLID_M_S
