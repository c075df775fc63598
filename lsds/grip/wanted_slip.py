"""Whether an object that is to slide falls: while the fingers move along something that stands, or turn about it.

The controller lets an object slide at the wanted speed, and stops one that slides much faster.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds.clock import nanoseconds

if TYPE_CHECKING:
    from lsds.contracts import Slide, SlipEstimate

SURE = 2.0
"""Standard deviations of which an estimate has to be beyond a bound."""
FASTER, FASTER_M_S, FASTER_RAD_S = 2.0, 0.01, 1.0
"""An object falls if it slides faster than this factor times the wanted speed, plus this speed."""
FALLS_S = 0.03


class WantedSlip:
    """Compares estimates with a wanted slip, over time."""

    def __init__(self) -> None:
        self._since_ns: int | None = None

    def falls(self, t_ns: int, estimate: SlipEstimate, slide: Slide) -> bool:
        """Return whether the object moves faster than it is to, for long enough not to be one wrong frame."""
        if estimate.abstained or not _is_beyond(estimate, slide):
            self._since_ns = None
            return False
        self._since_ns = t_ns if self._since_ns is None else self._since_ns
        return t_ns - self._since_ns >= nanoseconds(FALLS_S)


def _is_beyond(estimate: SlipEstimate, slide: Slide) -> bool:
    speed = estimate.speed_m_s - SURE * estimate.speed_std_m_s
    rate = abs(estimate.angular_rad_s) - SURE * estimate.angular_std_rad_s
    return speed > FASTER * slide.speed_m_s + FASTER_M_S or rate > FASTER * slide.rate_rad_s + FASTER_RAD_S
