"""The drives of a cell: the fingers' and the arm's, and the commands that they take."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds_mocks.plant.axis import ArmAxis, FingerDrive

if TYPE_CHECKING:
    from lsds.contracts.plant import Fingers

OPEN_APERTURE_M = 0.05
"""Aperture of the open fingers at the start, m: the stroke of a Hand-E."""


class Drives:
    """A `lsds.contracts.plant.Motion`: `fingers`, the vertical `arm`, and its `turn` about the pads' normal."""

    arm: ArmAxis
    turn: ArmAxis
    fingers: FingerDrive

    def __init__(self, arm_m: float, aperture_m: float = OPEN_APERTURE_M) -> None:
        self.arm = ArmAxis(arm_m)
        self.turn = ArmAxis(0.0)
        self.fingers = FingerDrive(aperture_m, aperture_m)

    def drive_fingers(self, aperture_m: float, speed_m_s: float, force_n: float) -> None:
        """Move the fingers to an aperture."""
        drive = self.fingers
        if isinstance(drive, FingerDrive):
            drive.target_m, drive.speed_m_s, drive.limit_n = aperture_m, speed_m_s, force_n

    def hold_fingers(self) -> None:
        """Hold the fingers where they are."""
        if isinstance(self.fingers, FingerDrive):
            self.fingers.target_m = self.fingers.aperture_m

    def use_fingers(self, fingers: Fingers) -> None:
        """Replace the fingers' drive by a gripper's own."""
        # The plant needs only the attributes of `Fingers`; callers that command `FingerDrive` check for it.
        self.fingers = fingers  # type: ignore[assignment]

    def drive_arm(
        self, speed_m_s: float, acceleration_m_s2: float, turn_rad_s: float = 0.0, turn_rad_s2: float = 40.0
    ) -> None:
        """Approach a vertical velocity and a turn about the pads' normal."""
        self.arm.target_m_s, self.arm.limit_m_s2 = speed_m_s, acceleration_m_s2
        self.turn.target_m_s, self.turn.limit_m_s2 = turn_rad_s, turn_rad_s2
