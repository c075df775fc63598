"""The plant of a simulated cell as device mocks see it: what they read, what they drive, and how time passes.

`join` returns the plant of a rig. Lengths are in metres, forces in newtons per finger, times in nanoseconds
on the rig's clock. In the plane of a pad, x is right and y down in the sensor's image; the origin is the pad's centre.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, Protocol, runtime_checkable

from lsds.contracts.values import Pose, Twist, Vector2
from lsds.errors import ConfigError, ConfigIssue

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds.contracts.backend import BuildContext
    from lsds.contracts.plant_links import PlantLinks


class Moment(NamedTuple):
    """Gripper and arm at the end of one step of the plant.

    `stalled`: the fingers push with their greatest force and do not move. `arm_z_m` is the height of the TCP above the
    table, `turn_rad` its turn about the pads' normal (y of the base).
    """

    t_ns: int
    aperture_m: float
    target_m: float
    moving: bool
    stalled: bool
    arm_z_m: float
    arm_v_m_s: float
    turn_rad: float
    turn_rad_s: float
    normal_n: float

    @property
    def tcp_pose(self) -> Pose:
        """Pose of the TCP above the point of the table where it started."""
        half = self.turn_rad / 2
        return Pose((0.0, 0.0, self.arm_z_m), (0.0, math.sin(half), 0.0, math.cos(half)))

    @property
    def tcp_twist(self) -> Twist:
        """Velocity of the TCP in the base frame."""
        return Twist((0.0, 0.0, self.arm_v_m_s), (0.0, self.turn_rad_s, 0.0))


class Motion(Protocol):
    """The drives of the plant. An action of `Plant.post` gets it at the instant at which it takes effect."""

    def drive_fingers(self, aperture_m: float, speed_m_s: float, force_n: float) -> None:
        """Move the fingers to an aperture; they stall if closing needs more than the force."""
        ...

    def hold_fingers(self) -> None:
        """Hold the fingers where they are."""
        ...

    def drive_arm(
        self, speed_m_s: float, acceleration_m_s2: float, turn_rad_s: float = 0.0, turn_rad_s2: float = 40.0
    ) -> None:
        """Approach a vertical velocity (up is positive) and a turn about the pads' normal; both last until changed."""
        ...


Action = Callable[[Motion], None]
"""The effect of a command on the plant, at the instant at which it takes effect."""


class Fingers(Protocol):
    """A gripper's own dynamics, which replace the drive of the plant: see `Plant.use_fingers`."""

    @property
    def aperture_m(self) -> float:
        """Distance between the fingers."""
        ...

    @property
    def target_m(self) -> float:
        """Aperture that they move to."""
        ...

    @property
    def moving(self) -> bool:
        """Whether they move."""
        ...

    @property
    def stalled(self) -> bool:
        """Whether they push with their greatest force and do not move."""
        ...

    def step(self, dt_s: float, force_n: float) -> None:
        """Advance by `dt_s` against the present normal force of one finger."""
        ...


class Touch(Protocol):
    """The gel of a finger at one instant: the tactile truth from which a sensor mock makes its image.

    It is that of the left finger. The right finger sees the mirror image, left to right.
    """

    @property
    def normal_n(self) -> float:
        """Normal force on the finger."""
        ...

    @property
    def tangential_n(self) -> Vector2:
        """Shear force of the object on the gel (x, y)."""
        ...

    def displacement_m(self, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement (N, 2) of surface points `xy_m` (N, 2) of the undeformed gel.

        Pass the same array object each time: the matrices for its points are made once.
        """
        ...

    def depth_m(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return the depth (>= 0, into the gel) of the surface on the grid of `y_m` (H,) by `x_m` (W,)."""
        ...

    def contact_fraction(self, width_m: float, height_m: float) -> float:
        """Return the part of a centred window that the object touches."""
        ...


class Exposing(Protocol):
    """A camera mock, which takes the gel at instants that it chooses in advance."""

    @property
    def next_exposure_ns(self) -> int:
        """When it exposes next."""
        ...

    def expose(self, touch: Touch) -> None:
        """Take the gel at `next_exposure_ns`, and choose the next instant."""
        ...


@runtime_checkable
class Plant(Protocol):
    """The plant shared by the device mocks of a rig. Nothing that is read changes what happens in it."""

    @property
    def t_ns(self) -> int:
        """The end of the last step."""
        ...

    @property
    def can_turn(self) -> bool:
        """Whether the arm may turn the pads about their normal."""
        ...

    def advance(self, t_ns: int) -> None:
        """Do all steps that end by a time. A device calls it before it reads."""
        ...

    def moment(self, t_ns: int) -> Moment:
        """Return the newest moment at or before `t_ns`, or the oldest kept."""
        ...

    def touch(self) -> Touch:
        """Return the gel at the end of the last step."""
        ...

    def post(self, t_ns: int, source: str, action: Action) -> None:
        """Have an action take effect at `t_ns`, in the order of (time, source, call). Safe from any thread."""
        ...

    def watch(self, camera: Exposing) -> None:
        """Add a camera, which exposes from now on."""
        ...

    def unwatch(self, camera: Exposing) -> None:
        """Remove a camera."""
        ...

    def use_fingers(self, fingers: Fingers) -> None:
        """Replace the drive of the fingers by a gripper's own.

        `Motion.drive_fingers` and `hold_fingers` then have no effect: actions change the gripper's own object.
        """
        ...


def join(context: BuildContext) -> Plant:
    """Return the plant of the rig's cell, or of the default cell if the rig names none. Call it in a device's factory.

    Declare the device with `BackendSpec(in_cell=True, virtual_time=True)`. Raises ConfigError if there is no cell, or
    if its plant is not in this process; PluginError if the default cell cannot be built.
    """
    cell = context.cell()
    if isinstance(cell, Plant):
        return cell
    problem = f"{type(cell).__name__} has no plant in this process" if cell is not None else "there is no cell"
    remedy = 'choose one that device mocks can join: [cell] backend = "simulated"'
    raise ConfigError("rig", [ConfigIssue("cell.backend", f"a device joins the simulated cell, and {problem}", remedy)])


def attach(context: BuildContext, address: str) -> PlantLinks:
    """Return the links to a plant in another process, for a wire mock. Call it in `start`, not in the factory.

    `address` is the socket at which `lsds mock plant` or a rig with `[cell] backend = "wire"` serves its plant; a rig
    passes it to its mocks as the option `cell`. Raises ConfigError if no installed plugin offers a cell on the wire.
    """
    from lsds.contracts.plant_links import PlantLinks

    cell = context.wired_cell(context, address) if context.wired_cell is not None else None
    if isinstance(cell, PlantLinks):
        return cell
    problem = "no installed plugin offers a cell on the wire"
    raise ConfigError("mock", [ConfigIssue("cell", problem, "install lsds with its mocks, or leave the option out")])
