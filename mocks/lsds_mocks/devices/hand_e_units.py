"""Conversions between SI units and the bytes of a Hand-E: position ticks, speed byte, force byte.

Robotiq Hand-E manual: position 0 open to 255 closed (about 3 to 228 are reached in practice), speed 0..255 for
20..150 mm/s, force 0..255 for 20..185 N, both linear.
"""

from __future__ import annotations

from dataclasses import dataclass

SPEED_RANGE_M_S = (0.020, 0.150)
"""Slowest and fastest speed of a finger, m/s (Hand-E data sheet)."""
FORCE_N = (20.0, 185.0)
"""Smallest and largest grip force, N (Hand-E data sheet)."""


@dataclass(frozen=True, slots=True)
class HandEUnits:
    """Conversions for one gripper's stroke and end ticks."""

    stroke_m: float
    open_tick: int
    closed_tick: int

    @property
    def metres_per_tick(self) -> float:
        """Aperture per tick."""
        return self.stroke_m / (self.closed_tick - self.open_tick)

    def tick(self, aperture_m: float) -> int:
        """Nearest reachable tick for an aperture."""
        tick = round(self.closed_tick - aperture_m / self.metres_per_tick)
        return min(max(tick, self.open_tick), self.closed_tick)

    def aperture_m(self, tick: int) -> float:
        """Aperture of a tick."""
        return (self.closed_tick - tick) * self.metres_per_tick


def to_byte(value: float, span: tuple[float, float]) -> int:
    """Nearest byte for a speed or a force within its span, limited to 0..255."""
    return min(max(round(255 * (value - span[0]) / (span[1] - span[0])), 0), 255)


def from_byte(byte: int, span: tuple[float, float]) -> float:
    """Speed or force of a byte."""
    return span[0] + (span[1] - span[0]) * byte / 255
