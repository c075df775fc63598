"""Contracts of devices. Structural: a backend implements the members, it inherits from nothing.

The life of a device: constructing does no I/O; `connect` makes it readable; `arm` makes it commandable and is the
only step that may move in order to activate; `disarm` takes the power to move away again; `close` gives the device
back. `stop` ends motion from any state and any thread, in bounded time, as often as it is called. `lifecycle` tells
the state. A call in the wrong state raises `LifecycleError`.
"""

from __future__ import annotations

from enum import Enum
from typing import Any, Protocol, runtime_checkable

from lsds.contracts.values import (
    ArmCommand,
    ArmSpec,
    ArmState,
    CellTruth,
    Frame,
    GripperCommand,
    GripperSpec,
    GripperState,
    PoseSample,
    SensorSpec,
)


class Lifecycle(Enum):
    """Where a device is in its life."""

    NEW = "new"
    CONNECTED = "connected"
    ARMED = "armed"
    CLOSED = "closed"


@runtime_checkable
class Device(Protocol):
    """What every device can do."""

    @property
    def lifecycle(self) -> Lifecycle:
        """Where the device is in its life."""
        ...

    def connect(self) -> None:
        """Open the device and make it readable. Does not move anything. Raises ConnectFailed."""
        ...

    def arm(self) -> None:
        """Make it commandable; the only step that may move in order to activate. Raises DeviceFault."""
        ...

    def stop(self) -> None:
        """End motion now: from any state, from any thread, in bounded time, any number of times. Never raises."""
        ...

    def disarm(self) -> None:
        """Back to readable only. Does nothing where it is not armed."""
        ...

    def close(self) -> None:
        """Stop, give the device back. Final; does nothing the second time."""
        ...


@runtime_checkable
class TactileSensor(Device, Protocol):
    """A camera-based tactile fingertip."""

    @property
    def spec(self) -> SensorSpec:
        """Image size, rate, scale, pad."""
        ...

    def read(self) -> Frame:
        """Return the newest frame; the same one again if no newer has come. Each frame's image is an array of its own,
        not written again. Raises StaleData, DataError for one damaged frame, EOFError where a recording has ended."""
        ...


@runtime_checkable
class Gripper(Device, Protocol):
    """A parallel gripper."""

    @property
    def spec(self) -> GripperSpec:
        """Stroke, resolution, speed and force ranges."""
        ...

    def read(self) -> GripperState:
        """Return the newest state. Raises StaleData, DeviceFault."""
        ...

    def command(self, command: GripperCommand) -> GripperCommand:
        """Send; return what was really sent, after limits and the device's resolution. Never blocks on motion.
        Raises LifecycleError, LimitExceeded (not finite), CommandExpired."""
        ...


@runtime_checkable
class Arm(Device, Protocol):
    """An arm that follows Cartesian velocities."""

    @property
    def spec(self) -> ArmSpec:
        """Speed, acceleration, reach."""
        ...

    def read(self) -> ArmState:
        """Return the newest state. Raises StaleData, DeviceFault."""
        ...

    def command(self, command: ArmCommand) -> ArmCommand:
        """Send; return what was really sent. The arm comes to rest when the command expires without a newer one.
        Raises LifecycleError, LimitExceeded (not finite), CommandExpired."""
        ...


@runtime_checkable
class PoseSource(Device, Protocol):
    """Something that sees where bodies are (ground truth, calibration)."""

    def read(self) -> PoseSample:
        """Return the newest poses. Raises StaleData."""
        ...


@runtime_checkable
class FidelityReporting(Protocol):
    """A cell that says how its physics was simulated."""

    def fidelity(self) -> dict[str, Any]:
        """Return plain values, ready for JSON; among them `summary`, one line, and `warnings`, a list of lines."""
        ...


@runtime_checkable
class Cell(Protocol):
    """The plant that mocks share: physics with a truth. A real cell has none."""

    def connect(self) -> None:
        """Make it ready, before any device connects. Raises ConnectFailed."""
        ...

    def close(self) -> None:
        """End what `connect` has started, after every device is closed. Does nothing the second time."""
        ...

    def advance(self, t_ns: int) -> None:
        """Bring the physics to a time; does nothing for a time already passed."""
        ...

    def truth(self) -> CellTruth:
        """Return what is really so at the time last advanced to."""
        ...
