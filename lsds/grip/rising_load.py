"""The squeeze that a rising load requires: beyond what a grip has carried, its friction limit is unknown."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds, seconds

if TYPE_CHECKING:
    from lsds.grip.options import GripOptions

RISE_WINDOW_S = 1.0
"""Time over which the rise of the load is measured, s; chosen: a rise of a tenth a second counts from 0.3 N on."""
RATE_WINDOW_S = 0.15
"""Minimum time by which a rise is divided to give its rate, s; chosen: in a shorter one noise looks steep."""
LOAD_SETTLES_S = 0.3
"""Time after a change of the arm's speed or a slide, next to the fingers' answer time, in which loads do not count, s;
chosen."""
RELATIVE_LOAD_NOISE = 0.03
"""Relative noise of a load from frame to frame; chosen. A rise within the window counts where it is greater than this
and `RISE_NOISE_N` together."""
RISE_NOISE_N = 0.02
"""Scatter of the difference of two small loads, N: two standard deviations of 0.007 N each, as of light objects at rest
on worn gels (simulated: 0.004 to 0.009 N)."""
WEAKEST_STDS = 2.0
"""Standard deviations below the median limit of unknown objects, of the weakest object that is reckoned with; chosen:
97.7 % of them carry more."""


class RisingLoad:
    """Keeps the greatest share of the friction limit that a grip has carried without slip in the air.

    The friction limit grows as squeeze^power. A load that has not slipped shows that the limit is greater, and nothing
    more. If the load rises, the grip therefore has to grow with it: the ratio of load to squeeze^power stays at most
    what it was before the rise. It need not grow beyond the squeeze with which the weakest objects carry the load: a
    light object in a firm grip has shown little, and may bear much.

    `power` is that of the squeeze, by default the options'.
    """

    def __init__(self, options: GripOptions, power: float | None = None) -> None:
        power = options.power if power is None else power
        self._power = power
        # N/mm^power is 1e3^power N/m^power.
        self._weakest = options.limit * math.exp(-WEAKEST_STDS * options.spread) * 1e3**power
        self._loads: deque[tuple[int, float]] = deque()
        self._carried = 0.0
        self._arm_m_s, self._accelerated_ns = 0.0, -nanoseconds(1.0)

    def forget(self, until_ns: int | None = None) -> None:
        """Start again: the object stands on something, or slides, until `until_ns`. Loads just after that show how
        it is taken up or braked, and do not count."""
        self._loads.clear()
        self._carried = 0.0
        self._accelerated_ns = self._accelerated_ns if until_ns is None else until_ns

    def required_m(self, t_ns: int, load_n: float, squeeze_m: float, answer_s: float, arm_m_s: float = 0.0) -> float:
        """Return the squeeze (m) for the load at the time of the fingers' answer; 0 if the load is not known to rise.

        `arm_m_s` is the speed of the arm. Loads just after it has changed show its acceleration, and do not count.
        """
        if arm_m_s != self._arm_m_s:
            self._arm_m_s, self._accelerated_ns = arm_m_s, t_ns
        if t_ns - self._accelerated_ns <= nanoseconds(LOAD_SETTLES_S + answer_s):
            return 0.0
        self._loads.append((t_ns, load_n))
        while self._loads[0][0] < t_ns - nanoseconds(RISE_WINDOW_S):
            self._loads.popleft()
        since_ns, before_n = self._loads[0]
        rise_n = load_n - before_n
        rises = rise_n > RELATIVE_LOAD_NOISE * load_n + RISE_NOISE_N
        if not self._carried or not rises:
            self._carried = max(self._carried, load_n / squeeze_m**self._power)
        if not rises:
            return 0.0
        ahead_n = load_n + rise_n / max(seconds(t_ns - since_ns), RATE_WINDOW_S) * answer_s
        return float((ahead_n / max(self._carried, self._weakest)) ** (1 / self._power))
