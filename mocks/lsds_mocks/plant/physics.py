"""The physics that a cell steps: the plant of this package, or a scene of another simulator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from lsds.contracts import CellTruth
    from lsds.contracts.plant import Fingers
    from lsds_mocks.gel.protocol import GelModel
    from lsds_mocks.gel.state import GelState
    from lsds_mocks.plant.axis import ArmAxis, FingerDrive


class Physics(Protocol):
    """Fingers, arm, gel and object, advanced together. It is also the `lsds.contracts.plant.Motion` of commands."""

    gel: GelModel
    arm: ArmAxis
    turn: ArmAxis
    fingers: FingerDrive
    normal_n: float

    @property
    def can_turn(self) -> bool:
        """Whether the arm may rotate the pads about their normal."""
        ...

    @property
    def greatest_strain(self) -> float:
        """Greatest indentation so far, as part of the gel's thickness."""
        ...

    def step(self, dt_s: float) -> None:
        """Advance by a step of the cell."""
        ...

    def gel_state(self) -> GelState:
        """Return a copy of the gel's history, including the object's placement."""
        ...

    def truth(self, t_ns: int) -> CellTruth:
        """Return the truth, stamped `t_ns`."""
        ...

    def use_fingers(self, fingers: Fingers) -> None:
        """Replace the fingers' drive by a gripper's own."""
        ...

    def drive_fingers(self, aperture_m: float, speed_m_s: float, force_n: float) -> None:
        """Move the fingers to an aperture; they stall if closing needs more than the force."""
        ...

    def hold_fingers(self) -> None:
        """Hold the fingers where they are."""
        ...

    def drive_arm(
        self, speed_m_s: float, acceleration_m_s2: float, turn_rad_s: float = 0.0, turn_rad_s2: float = 40.0
    ) -> None:
        """Approach a vertical velocity and a turn about the pads' normal."""
        ...
