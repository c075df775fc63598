"""The options of the camera `lsds`, as LeRobot reads them from a command line or a file."""

from __future__ import annotations

from dataclasses import dataclass, field

from lerobot.cameras.configs import CameraConfig


@CameraConfig.register_subclass("lsds")
@dataclass(kw_only=True)
class LsdsCameraConfig(CameraConfig):
    """A fingertip: that of a rig file, or a sensor backend with its options.

    `rig` is a rig file and `finger` one of its fingers, the first if empty. Without `rig`, `sensor` is the backend and
    `options` are its options as "key=value", such as "camera=/dev/video2". `overrides` change keys of the
    configuration, such as "cell.simulated.fidelity=winkler". `width`, `height` (px) and `fps` may be left out; if they
    are given, they must be those of the sensor.
    """

    rig: str = ""
    finger: str = ""
    sensor: str = "mock-gelsight-mini"
    options: list[str] = field(default_factory=list)
    overrides: list[str] = field(default_factory=list)
