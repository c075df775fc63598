"""The physics that a cell steps: the drives of fingers and arm, and what a plant or another simulator makes of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from lsds_mocks.plant.axis import ArmAxis, FingerDrive
from lsds_mocks.plant.lift import GRAVITY_M_S2

if TYPE_CHECKING:
    from lsds.contracts import CellTruth
    from lsds.contracts.plant import Fingers
    from lsds_mocks.gel.protocol import GelModel
    from lsds_mocks.gel.state import GelState

FINGERS = 2
"""Number of fingers that carry the object."""
OPEN_APERTURE_M = 0.05
"""Aperture of the open fingers at the start, m: the stroke of a Hand-E."""


class Physics(ABC):
    """Fingers, arm, gel and object, advanced together. It is the `lsds.contracts.plant.Motion` of commands.

    `turn` is the rotation of the pads about their normal, `normal_n` the normal force of a finger.
    """

    gel: GelModel
    arm: ArmAxis
    turn: ArmAxis
    fingers: FingerDrive
    normal_n: float
    gravity_m_s2: float = GRAVITY_M_S2

    def __init__(self, arm_m: float) -> None:
        self.arm = ArmAxis(arm_m)
        self.turn = ArmAxis(0.0)
        self.fingers = FingerDrive(OPEN_APERTURE_M, OPEN_APERTURE_M)

    @property
    @abstractmethod
    def can_turn(self) -> bool:
        """Whether the arm may rotate the pads about their normal."""

    @property
    @abstractmethod
    def greatest_strain(self) -> float:
        """Greatest indentation so far, as part of the gel's thickness."""

    @property
    def invalid(self) -> tuple[str, ...]:
        """Why results so far are not valid, apart from the strain of the gel."""
        return ()

    @property
    @abstractmethod
    def object_height_m(self) -> float:
        """Height of the object above its start, m."""

    @property
    @abstractmethod
    def object_velocity_m_s(self) -> float:
        """Upward velocity of the object, m/s."""

    @abstractmethod
    def step(self, dt_s: float) -> None:
        """Advance by a step of the cell."""

    @abstractmethod
    def gel_state(self) -> GelState:
        """Return a copy of the gel's history, including the object's placement."""

    @abstractmethod
    def truth(self, t_ns: int) -> CellTruth:
        """Return the truth, stamped `t_ns`."""

    def drive_fingers(self, aperture_m: float, speed_m_s: float, force_n: float) -> None:
        """Move the fingers to an aperture; they stall if closing needs more than the force."""
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

    def normal_for(self, mass_kg: float, friction: float, push_n: float = 0.0) -> float:
        """Return the least normal force per finger (N) that carries a mass against gravity, the arm's acceleration and
        a push, at a static friction coefficient."""
        pull_n = mass_kg * (self.gravity_m_s2 + max(self.arm.acceleration_m_s2, 0.0))
        return (pull_n + push_n) / (FINGERS * friction)
