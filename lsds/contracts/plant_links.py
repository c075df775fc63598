"""Links of wire mocks to a plant in another process: see `lsds.contracts.plant.attach`.

Times are the rig's monotonic nanoseconds, lengths are in metres, forces in newtons per finger.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable


class FingerState(NamedTuple):
    """The gripper's mechanics at one instant. Forces are per finger."""

    t_ns: int
    aperture_m: float
    target_m: float
    moving: bool
    stalled: bool
    normal_n: float


class FingerLink(Protocol):
    """The link of a gripper mock to its fingers."""

    def drive(self, target_m: float, speed_m_s: float, limit_n: float) -> None:
        """Move to an aperture at a finger speed with a force limit; takes effect at once. Never blocks."""
        ...

    def hold(self) -> None:
        """Stay at the present aperture."""
        ...

    def fingers(self) -> FingerState:
        """Return the newest state. Never blocks."""
        ...

    def close(self) -> None:
        """Give the link back."""
        ...


class Load(NamedTuple):
    """Load on the arm's flange at one instant: downward force of a held object (N)."""

    t_ns: int
    pull_n: float


class ArmLink(Protocol):
    """The link of an arm mock to its load."""

    def follow(self, t_ns: int, height_m: float, velocity_m_s: float) -> None:
        """Send the TCP's height in the base frame and its vertical velocity. Never blocks."""
        ...

    def load(self) -> Load:
        """Return the newest load. Never blocks."""
        ...

    def close(self) -> None:
        """Close the link; the carrier comes to rest."""
        ...


class Scene(NamedTuple):
    """Positions in the cell at one instant, for a camera: heights above the table, and the slip of the object in the
    fingers (m, down is positive)."""

    t_ns: int
    arm_m: float
    object_m: float


class SceneLink(Protocol):
    """The link of a ground-truth camera mock to the scene."""

    def scene(self, t_ns: int) -> Scene | None:
        """Return the scene at a past instant; None if it is not available yet or any more."""
        ...

    def close(self) -> None:
        """Give the link back."""
        ...


@runtime_checkable
class PlantLinks(Protocol):
    """Connects to the plant of a cell on the wire. Each call opens a link, which the caller closes.

    Raises ConnectFailed if no plant serves at the address of the cell.
    """

    def finger_link(self) -> FingerLink:
        """Return a link for a gripper mock."""
        ...

    def arm_link(self) -> ArmLink:
        """Return a link for an arm mock."""
        ...

    def scene_link(self) -> SceneLink:
        """Return a link for a camera that observes the cell."""
        ...
