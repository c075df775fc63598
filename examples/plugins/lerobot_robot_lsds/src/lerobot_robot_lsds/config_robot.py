"""The options of the robot `lsds`, as LeRobot reads them from a command line or a file."""

from __future__ import annotations

from dataclasses import dataclass, field

from lerobot.cameras.configs import CameraConfig
from lerobot.robots.config import RobotConfig


@RobotConfig.register_subclass("lsds")
@dataclass(kw_only=True)
class LsdsRobotConfig(RobotConfig):
    """A gripper with tactile fingertips: that of a rig file, or the simulated cell without one.

    `rig` is a rig file, and `overrides` change its keys, such as "gripper.hand-e.port=/dev/ttyUSB0". `images` adds the
    image of each fingertip to the observations. `step_s` is the simulated time per observation (s); a real rig runs in
    real time. `cameras` are further cameras of LeRobot, by name.
    """

    rig: str = ""
    overrides: list[str] = field(default_factory=list)
    images: bool = True
    step_s: float = 0.04
    cameras: dict[str, CameraConfig] = field(default_factory=dict)
