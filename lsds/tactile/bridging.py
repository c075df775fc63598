"""The last measured slip velocity, carried over the few frames in which no motion could be measured.

The velocity is modelled as a random walk: its expectation stays, and its variance grows linearly with time.
"""

from __future__ import annotations

import math
from dataclasses import replace

from lsds.contracts import ABSTAINED, SlipEstimate

#: Maximum number of consecutive frames that one measurement bridges.
MOST_BRIDGED_FRAMES = 3


class VelocityBridge:
    """Carries an estimator's last measurement for at most `MOST_BRIDGED_FRAMES` frames."""

    def __init__(self, walk_m_s_rts: float, walk_rad_s_rts: float) -> None:
        """Intensities of the random walk of the linear (m/s per root second) and angular velocity (rad/s per root s).

        Each is the standard deviation of the change of velocity between frames, divided by the root of their interval.
        """
        self._linear, self._angular = walk_m_s_rts, walk_rad_s_rts
        self.reset()

    def reset(self) -> None:
        """Forget the last measurement."""
        self._last: SlipEstimate = ABSTAINED
        self._frames, self._elapsed_s = 0, 0.0

    def update(self, estimate: SlipEstimate, dt_s: float) -> tuple[SlipEstimate, int]:
        """Return the estimate of this frame, and for how many frames it has been carried (0: measured or abstained).

        `dt_s` is the measured interval to the previous frame. Without a known interval, the bridge ends.
        """
        if not estimate.abstained:
            self.reset()
            self._last = estimate
            return estimate, 0
        if self._last.abstained or self._frames == MOST_BRIDGED_FRAMES or not 0 < dt_s < math.inf:
            self.reset()
            return estimate, 0
        self._frames += 1
        self._elapsed_s += dt_s
        return self._carried(), self._frames

    def _carried(self) -> SlipEstimate:
        last, root = self._last, math.sqrt(self._elapsed_s)
        x_std, y_std = last.velocity_std_m_s
        linear = self._linear * root
        return replace(
            last,
            velocity_std_m_s=(math.hypot(x_std, linear), math.hypot(y_std, linear)),
            angular_std_rad_s=math.hypot(last.angular_std_rad_s, self._angular * root),
            speed_std_m_s=math.hypot(last.speed_std_m_s, linear),
        )
