"""Contracts of devices. They are structural: a backend implements the members and needs no base class.

The life of a device: constructing does no I/O; `connect` makes it readable; `arm` makes it commandable and is the
only step that may move in order to activate; `disarm` makes it readable only again; `close` releases the device.
`stop` ends motion from any state and any thread, in bounded time, any number of times. `lifecycle` is the present
state. A call in the wrong state raises `LifecycleError`.

All calls but `stop` come from one thread at a time, which is not the main one; each has a deadline (`docs/safety.md`),
after which the device is left behind in that call. A `close` from another thread may come then.
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
    """The state of a device's life cycle."""

    NEW = "new"
    CONNECTED = "connected"
    ARMED = "armed"
    CLOSED = "closed"


@runtime_checkable
class Device(Protocol):
    """The members common to all devices."""

    @property
    def lifecycle(self) -> Lifecycle:
        """The state of the device's life cycle."""
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
        """Make it readable only; an arm comes to rest, a gripper keeps its grip. Does nothing if it is not armed."""
        ...

    def close(self) -> None:
        """Stop and release the device. Final; a second call does nothing."""
        ...


@runtime_checkable
class TactileSensor(Device, Protocol):
    """A camera-based tactile fingertip."""

    @property
    def spec(self) -> SensorSpec:
        """Image size, rate, scale, pad."""
        ...

    def read(self) -> Frame:
        """Return the newest frame; the same one again if there is no newer one. Each frame has its own image array,
        which is not modified later. Raises StaleData, DataError for a damaged frame, EOFError at the end of a
        recording."""
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
        """Send the command; return it as sent, after limits and the device's resolution. Never waits for motion.
        Raises LifecycleError, LimitExceeded (not finite), CommandExpired."""
        ...


@runtime_checkable
class Arm(Device, Protocol):
    """An arm that follows Cartesian velocity commands."""

    @property
    def spec(self) -> ArmSpec:
        """Speed, acceleration, reach."""
        ...

    def read(self) -> ArmState:
        """Return the newest state. Raises StaleData, DeviceFault."""
        ...

    def command(self, command: ArmCommand) -> ArmCommand:
        """Send the command; return it as sent. The arm stops when the command expires without a newer one.
        Raises LifecycleError, LimitExceeded (not finite), CommandExpired."""
        ...


@runtime_checkable
class PoseSource(Device, Protocol):
    """A source of the poses of bodies (ground truth, calibration)."""

    def read(self) -> PoseSample:
        """Return the newest poses. Raises StaleData."""
        ...


@runtime_checkable
class FidelityReporting(Protocol):
    """A cell that reports how its physics is simulated."""

    def fidelity(self) -> dict[str, Any]:
        """Return plain values, ready for JSON; among them `summary`, one line, and `warnings`, a list of lines.

        `invalid`, if given, lists why the run lies outside the model's validity; empty if it does not.
        """
        ...


@runtime_checkable
class Cell(Protocol):
    """The plant shared by simulated devices: physics with a known truth. A real cell has none."""

    def connect(self) -> None:
        """Start it, before any device connects. Raises ConnectFailed."""
        ...

    def close(self) -> None:
        """Stop what `connect` has started, after every device is closed. A second call does nothing."""
        ...

    def advance(self, t_ns: int) -> None:
        """Advance the physics to a time; does nothing if it is already past that time."""
        ...

    def truth(self) -> CellTruth:
        """Return the true state at the time last advanced to."""
        ...
