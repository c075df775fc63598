"""Conversion between SI units and counts. Positions range from 0 (open) to 255 (closed), of which a gripper reaches a
part; all conversions are linear.

Robotiq manuals: Hand-E 50 mm, 20 to 150 mm/s, 20 to 185 N; 2F-85 85 mm, 20 to 150 mm/s, 20 to 235 N; 2F-140 140 mm,
30 to 250 mm/s, 10 to 125 N.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lsds_drivers.robotiq.registers import Motion

if TYPE_CHECKING:
    from lsds.contracts import GripperCommand


@dataclass(frozen=True, slots=True)
class Figures:
    """One gripper's stroke (m), ranges of speed (m/s) and force (N), and counts when fully open and closed."""

    stroke_m: float
    speed_m_s: tuple[float, float]
    force_n: tuple[float, float]
    open_count: int = 3
    closed_count: int = 228

    @property
    def resolution_m(self) -> float:
        """Aperture of one count."""
        return self.stroke_m / (self.closed_count - self.open_count)

    def aperture_m(self, count: int) -> float:
        """Return the aperture of a position count, clamped to the ends of the stroke."""
        return (self.closed_count - min(max(count, self.open_count), self.closed_count)) * self.resolution_m

    def motion(self, command: GripperCommand) -> Motion:
        """Return the nearest counts that this gripper accepts."""
        position = round(self.closed_count - command.aperture_m / self.resolution_m)
        return Motion(
            min(max(position, self.open_count), self.closed_count),
            _count(command.speed_m_s, self.speed_m_s),
            _count(command.force_n, self.force_n),
        )

    def speed_of(self, count: int) -> float:
        """Return the speed (m/s) of a count."""
        return _value(count, self.speed_m_s)

    def force_of(self, count: int) -> float:
        """Return the force (N) of a count."""
        return _value(count, self.force_n)


HAND_E = Figures(0.050, (0.020, 0.150), (20.0, 185.0))
TWO_FINGER = {
    85: Figures(0.085, (0.020, 0.150), (20.0, 235.0)),
    140: Figures(0.140, (0.030, 0.250), (10.0, 125.0)),
}


def _count(value: float, span: tuple[float, float]) -> int:
    low, high = span
    return min(max(round(255 * (value - low) / (high - low)), 0), 255)


def _value(count: int, span: tuple[float, float]) -> float:
    low, high = span
    return low + (high - low) * count / 255
