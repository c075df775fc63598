"""Compares the closings that a gripper reports with the normal force that the gel shows.

A gripper whose position sensor, coupling or firmware is at fault may report a motion that its fingers do not make. The
gel shows it: the normal force grows with a power of the squeeze (`grip.power`), whatever the object.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from lsds.clock import nanoseconds
from lsds.errors import SafetyStop

WINDOW_S = 2.0
"""Time over which closings are added up, s; chosen."""
RESPONSE_S = 0.12
"""Time in which the normal force follows a closing, s: three frames of a sensor with 25 images a second."""
CLOSES = 0.005
"""Minimum relative growth of the squeeze from frame to frame that is a closing; chosen: half a percent."""
EXPECTED = 0.4
"""Growth of the normal force by closings (natural logarithm) from which on they are judged; chosen: by half."""
LEAST_SHARE = 0.3
"""Share of the expected growth that the gel has to show. In 15 lifts of random objects (development draws, simulated)
that closed by as much, it showed at least 0.59, spheres that were squeezed out included."""
FIRST_NOISE = 0.05
"""Scatter of the force from frame to frame (natural logarithm) that is assumed before it is known; chosen."""
NEW_SHARE = 0.1
"""Weight of a frame in the running means of that scatter, and of the force's own decay; chosen: ten frames count."""
NOISE_STDS = 2.0
"""Standard deviations of its noise by which the force must have grown too little; chosen."""


class _Seen(NamedTuple):
    t_ns: int
    expected: float
    shown: float
    from_m: float
    begins: bool


class PressWatch:
    """Watches one grip. `power` is the exponent by which the normal force grows with the squeeze."""

    def __init__(self, power: float) -> None:
        self._power = power
        self.reset()

    def reset(self) -> None:
        """Forget the object."""
        self._seen: deque[_Seen] = deque()
        self._last: tuple[float, float] | None = None
        self._closed_ns: int | None = None
        self._noise, self._decay = FIRST_NOISE, 0.0
        self._follows = False

    def take(self, t_ns: int, squeeze_m: float, normal_n: float) -> None:
        """Take the reported squeeze (m) at the time of a frame and the normal force (N) that the frame shows.

        Frames without a known force or squeeze are left out. Raises SafetyStop if closings have no effect on the gel.
        """
        if not (0 < squeeze_m < math.inf and 0 < normal_n < math.inf):
            return
        before, self._last = self._last, (math.log(squeeze_m), math.log(normal_n))
        if before is None:
            return
        closed, grown = self._last[0] - before[0], self._last[1] - before[1]
        if abs(closed) > CLOSES:
            self._closed_ns = t_ns if closed > 0 else None
        # Only what follows a closing counts, less the decay before it: a sphere that slips along the pad loses force.
        follows = self._closed_ns is not None and t_ns - self._closed_ns <= nanoseconds(RESPONSE_S)
        if follows:
            # The estimate of the force leaps where the object falls fast: a leap down is no answer to a closing.
            shown = max(grown - self._decay, -NOISE_STDS * self._noise)
            self._seen.append(_Seen(t_ns, self._power * closed, shown, math.exp(before[0]), not self._follows))
        elif abs(closed) <= CLOSES:
            self._noise += NEW_SHARE * (abs(grown - self._decay) - self._noise)
            self._decay = min(self._decay + NEW_SHARE * (grown - self._decay), 0.0)
        self._follows = follows
        while self._seen and self._seen[0].t_ns < t_ns - nanoseconds(WINDOW_S):
            self._seen.popleft()
        self._require_response(t_ns, squeeze_m)

    def _require_response(self, t_ns: int, squeeze_m: float) -> None:
        answered_ns = t_ns - nanoseconds(RESPONSE_S)
        expected = sum(seen.expected for seen in self._seen if seen.t_ns <= answered_ns)
        if expected <= EXPECTED:
            return
        shown = sum(seen.shown for seen in self._seen)
        # The changes of successive frames add up to the difference of two, so each series has the noise of one change.
        series = max(sum(seen.begins for seen in self._seen), 1)
        if shown + NOISE_STDS * self._noise * math.sqrt(series) < LEAST_SHARE * expected:
            closed_mm = 1e3 * (squeeze_m - self._seen[0].from_m)
            raise SafetyStop(
                f"gripper: it reports that its fingers closed by {closed_mm:.2f} mm, but "
                f"the normal force on the gel changed by {100 * math.expm1(shown):+.0f} % instead of "
                f"{100 * math.expm1(expected):+.0f} % (check its fingers, their coupling and its position sensor)"
            )
