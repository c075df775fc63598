"""The interface of a camera."""

from __future__ import annotations

import abc
from typing import Any

from numpy.typing import NDArray

from lerobot.cameras.configs import CameraConfig


class Camera(abc.ABC):
    """A camera; a subclass implements all abstract members."""

    def __init__(self, config: CameraConfig) -> None:
        self.fps: int | None = config.fps
        self.width: int | None = config.width
        self.height: int | None = config.height

    def __enter__(self) -> Camera:
        self.connect()
        return self

    def __exit__(self, *_: object) -> None:
        self.disconnect()

    @property
    @abc.abstractmethod
    def is_connected(self) -> bool: ...

    @staticmethod
    @abc.abstractmethod
    def find_cameras() -> list[dict[str, Any]]: ...

    @abc.abstractmethod
    def connect(self, warmup: bool = True) -> None: ...

    @abc.abstractmethod
    def read(self) -> NDArray[Any]: ...

    @abc.abstractmethod
    def async_read(self, timeout_ms: float = ...) -> NDArray[Any]: ...

    @abc.abstractmethod
    def read_latest(self, max_age_ms: int = ...) -> NDArray[Any]: ...

    @abc.abstractmethod
    def disconnect(self) -> None: ...
