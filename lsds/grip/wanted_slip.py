"""Whether an object that is to slide falls: while the fingers move along something that stands, or turn about it.

The controller lets an object slide at the wanted speed, and stops one that slides much faster.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds.clock import nanoseconds

if TYPE_CHECKING:
    from lsds.contracts import Slide, SlipEstimate

BEYOND_STDS = 2.0
"""Number of standard deviations by which an estimate must exceed a bound; chosen: 98 % of a normal distribution."""
FALLS_FACTOR = 2.0
"""Factor on the wanted speed in the bound above which an object falls; chosen."""
FALLS_OFFSET_M_S = 0.01
"""Linear speed that is added to that bound, m/s; chosen."""
FALLS_OFFSET_RAD_S = 1.0
"""Angular velocity that is added to that bound, rad/s; chosen."""
FALLS_S = 0.03
"""Time for which an object must exceed the bound before it falls, s; chosen, so that one wrong frame does not count."""


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
    speed = estimate.speed_m_s - BEYOND_STDS * estimate.speed_std_m_s
    rate = abs(estimate.angular_rad_s) - BEYOND_STDS * estimate.angular_std_rad_s
    return (
        speed > FALLS_FACTOR * slide.speed_m_s + FALLS_OFFSET_M_S
        or rate > FALLS_FACTOR * slide.rate_rad_s + FALLS_OFFSET_RAD_S
    )
