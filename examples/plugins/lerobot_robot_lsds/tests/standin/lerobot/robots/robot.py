"""The interface of a robot."""

from __future__ import annotations

import abc
from typing import Any

from lerobot.robots.config import RobotConfig


class Robot(abc.ABC):
    """A robot; a subclass implements all abstract members."""

    config_class: type[RobotConfig]
    name: str

    def __init__(self, config: RobotConfig) -> None:
        self.robot_type = self.name
        self.id = config.id

    @property
    @abc.abstractmethod
    def observation_features(self) -> dict[str, Any]: ...

    @property
    @abc.abstractmethod
    def action_features(self) -> dict[str, Any]: ...

    @property
    @abc.abstractmethod
    def is_connected(self) -> bool: ...

    @abc.abstractmethod
    def connect(self, calibrate: bool = True) -> None: ...

    @property
    @abc.abstractmethod
    def is_calibrated(self) -> bool: ...

    @abc.abstractmethod
    def calibrate(self) -> None: ...

    @abc.abstractmethod
    def configure(self) -> None: ...

    @abc.abstractmethod
    def get_observation(self) -> dict[str, Any]: ...

    @abc.abstractmethod
    def send_action(self, action: dict[str, Any]) -> dict[str, Any]: ...

    @abc.abstractmethod
    def disconnect(self) -> None: ...
