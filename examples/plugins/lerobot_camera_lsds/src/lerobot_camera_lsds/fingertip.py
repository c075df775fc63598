"""One fingertip of a rig without its gripper and arm: the sensor that a camera reads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import lsds
from lsds.clock import nanoseconds
from lsds.errors import ConfigError, ConfigIssue

if TYPE_CHECKING:
    from lsds.contracts import Frame
    from lsds.contracts.values import SensorSpec

_ALONE = ("gripper.backend=none", "arm.backend=none", "pose_source.backend=none")
"""Overrides that keep a camera from connecting, and so from moving, any other device of the rig."""


class Fingertip:
    """Reads the frames of one finger. One thread calls it."""

    def __init__(self, rig: str, finger: str, sensor: str, options: list[str], overrides: list[str]) -> None:
        """Load the configuration without any I/O on devices. Raises ConfigError, PluginError."""
        chosen = [] if rig else [f"sensor.backend={sensor}", *(f"sensor.{sensor}.{option}" for option in options)]
        if rig and options:
            problem = "options belong to a sensor, and a rig file is given"
            raise ConfigError("camera lsds", [ConfigIssue("options", problem, "write them as overrides of the rig")])
        config = lsds.load_config(rig or None, [*chosen, *overrides, *_ALONE])
        self._rig = lsds.Rig(config)
        fingers = {one.name: one for one in self._rig.fingers}
        if finger and finger not in fingers:
            raise ConfigError(
                "camera lsds", [ConfigIssue("finger", f"no finger '{finger}'", f"one of: {', '.join(fingers)}")]
            )
        self._sensor = fingers[finger].sensor if finger else self._rig.sensor
        self._period_ns = 0

    @property
    def spec(self) -> SensorSpec:
        """Image size (px) and rate (Hz) of the sensor; valid after `connect`."""
        return self._sensor.spec

    @property
    def simulated(self) -> bool:
        """Whether time passes only when frames are read."""
        return self._rig.virtual

    def connect(self) -> None:
        """Connect the sensor. Raises BringUpError, everything closed."""
        self._rig.connect()
        self._period_ns = nanoseconds(1 / self.spec.rate_hz)

    def step(self) -> None:
        """Let one frame interval of simulated time pass; does nothing in real time."""
        if self.simulated:
            self._rig.clock.sleep_until(self._rig.clock.now() + self._period_ns)

    def read(self) -> Frame:
        """Return the newest frame. Raises StaleData, DataError, EOFError, DeviceFault."""
        return self._sensor.read()

    def close(self) -> None:
        """Close the sensor; a second call does nothing."""
        self._rig.close()
