"""Compares the closings that a gripper reports with the normal force that the gel shows.

A gripper whose position sensor, coupling or firmware is at fault may report a motion that its fingers do not make. The
gel shows it: the normal force of an elastic contact grows with a power of the squeeze (`grip.power`). Objects that
yield at a constant force, as foam and thin cups may, are not elastic: `safety.watch_press` turns the comparison off.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, NamedTuple

from lsds.clock import nanoseconds
from lsds.errors import SafetyStop

if TYPE_CHECKING:
    from lsds.contracts import GripEstimate

WINDOW_S = 2.0
"""Time after which a series of closings no longer counts, s; chosen."""
MOST_KEPT = 500
"""Greatest number of frames of a series of closings: an aperture that never rests is one without an end; chosen."""
RESPONSE_S = 0.12
"""Minimum time in which the normal force may follow the fingers, s: three frames at 25 images a second."""
RESPONSE_FRAMES = 2
"""Minimum number of frames in which it may follow them, for slower sensors; chosen."""
EXPECTED = 0.4
"""Minimum expected growth of the normal force that is judged (natural logarithm); chosen: by half."""
LEAST_SHARE = 0.3
"""Minimum share of the expected growth. In 15 lifts of random objects (development draws, simulated) that closed by as
much, the gel showed at least 0.59, spheres that were squeezed out included."""
FIRST_NOISE = 0.05
"""Scatter of the force from frame to frame (natural logarithm) that is assumed before it is known; chosen."""
NEW_SHARE = 0.1
"""Weight of a frame in the running means of that scatter, and of the force's own decay; chosen: ten frames count."""
NOISE_STDS = 2.0
"""Standard deviations of its noise by which the force must have grown too little; chosen."""
LEAST_PLAY_M = 1e-4
"""Minimum play of the reported squeeze: an aperture that flickers by less has not changed, m; chosen."""


SHORT_REACH_M = 6e-3
"""Half-length of a contact along the load, m, below which a slide is not judged: one that slips along the pad
loses its normal force whatever the fingers do. Pipes and edges reach 8.7 mm, spheres and corners 3 to 5 (simulated)."""


class _Seen(NamedTuple):
    t_ns: int
    frame: int
    expected: float
    shown: float
    closed_m: float


class PressWatch:
    """Watches one grip. `power` is the exponent by which the normal force grows with the squeeze.

    `tick_m` is the resolution of the reported aperture.
    """

    def __init__(self, power: float, tick_m: float = 0.0) -> None:
        self._power, self._play_m = power, max(1.01 * tick_m, LEAST_PLAY_M)
        self.reset()

    def reset(self) -> None:
        """Forget the object."""
        #: Frames of each series of closings, in which the force follows the fingers without a pause.
        self._series: deque[deque[_Seen]] = deque()
        self._squeeze_m = self._ln_normal = math.nan
        self._changed: tuple[int, int] | None = None
        self._frame = 0
        self._noise, self._decay = FIRST_NOISE, 0.0
        self._follows = False

    def see(self, grip: GripEstimate, squeeze_m: float, touch_std_m: float = 0.0) -> None:
        """Take a round of the grip; nothing is judged while a short contact may slide. Raises SafetyStop as `take`.

        `squeeze_m` is counted from the touch that was noticed, not from the one that the normal force suggests. A touch
        that was noticed late makes it look smaller than it is, and its growth greater: it counts with NOISE_STDS times
        the standard deviation `touch_std_m` of the touch added.
        """
        if grip.may_slide and grip.reach_m < SHORT_REACH_M:
            self.reset()
        else:
            self.take(grip.t_ns, squeeze_m + NOISE_STDS * touch_std_m, grip.normal_n)

    def take(self, t_ns: int, squeeze_m: float, normal_n: float) -> None:
        """Take the reported squeeze (m) at the time of a frame and the normal force (N) that the frame shows.

        Frames without a known force or squeeze are left out. Raises SafetyStop if closings have no effect on the gel.
        """
        if not (0 < squeeze_m < math.inf and 0 < normal_n < math.inf):
            return
        before_m, before = self._squeeze_m, self._ln_normal
        # Within its play the reported squeeze says nothing: an aperture that flickers is at rest.
        half_m = min(self._play_m, squeeze_m) / 2
        self._squeeze_m = min(max(before_m, squeeze_m - half_m), squeeze_m + half_m) if before_m > 0 else squeeze_m
        self._ln_normal = math.log(normal_n)
        if not before_m > 0:
            return
        closed, grown = math.log(self._squeeze_m / before_m), self._ln_normal - before
        self._frame += 1
        if closed:
            self._changed = t_ns, self._frame
        # Only what follows the fingers counts, less the decay before: a sphere that slips along the pad loses force.
        follows = self._changed is not None and self._may_follow(*self._changed, t_ns)
        if follows:
            # If an object falls fast, the estimate of the force drops abruptly; such a drop is limited to the noise.
            shown = max(grown - self._decay, -NOISE_STDS * self._noise)
            moved_m = self._squeeze_m - before_m
            if not (self._follows and self._series):
                self._series.append(deque(maxlen=MOST_KEPT))
            self._series[-1].append(_Seen(t_ns, self._frame, self._power * closed, shown, moved_m))
        else:
            self._noise += NEW_SHARE * (abs(grown - self._decay) - self._noise)
            self._decay = min(self._decay + NEW_SHARE * (grown - self._decay), 0.0)
        self._follows = follows
        # Never a part of a series: the force may grow a frame before the reported squeeze, which would tear them apart.
        while self._series and self._series[0][-1].t_ns < t_ns - nanoseconds(WINDOW_S):
            self._series.popleft()
        self._require_response(t_ns)

    def _may_follow(self, changed_ns: int, frame: int, now_ns: int) -> bool:
        """Return whether the force may still follow a change of the squeeze."""
        return now_ns - changed_ns <= nanoseconds(RESPONSE_S) or self._frame - frame <= RESPONSE_FRAMES

    def _require_response(self, now_ns: int) -> None:
        """Raise SafetyStop if the force has not followed the closings that it should have followed by now."""
        kept = [seen for series in self._series for seen in series]
        due = [seen for seen in kept if not self._may_follow(seen.t_ns, seen.frame, now_ns)]
        expected = sum(seen.expected for seen in due)
        if expected <= EXPECTED:
            return
        shown = sum(seen.shown for seen in kept)
        # The changes of successive frames add up to the difference of two, so each series has the noise of one change.
        if shown + NOISE_STDS * self._noise * math.sqrt(len(self._series)) < LEAST_SHARE * expected:
            closed_mm = 1e3 * sum(seen.closed_m for seen in due)
            raise SafetyStop(
                f"gripper: it reports that its fingers closed by {closed_mm:.2f} mm, but the normal force on the gel "
                f"changed by {100 * math.expm1(shown):+.0f} % instead of {100 * math.expm1(expected):+.0f} % "
                "(check its fingers, their coupling and its position sensor; for an object that yields: "
                "safety.watch_press = false)"
            )
