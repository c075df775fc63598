"""A fingertip of lsds behind LeRobot's camera interface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lsds.registry import PluginHost

from lerobot.cameras.camera import Camera
from lerobot_camera_lsds.capture import Capture
from lerobot_camera_lsds.config_camera import LsdsCameraConfig
from lerobot_camera_lsds.fingertip import Fingertip

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

READ_S = 5.0
"""Time limit of `read` (s): a camera on USB may need some seconds until its first frame."""
RATE_SHARE = 0.05
"""`fps` may differ from the nominal rate of the sensor by this share."""


class LsdsCamera(Camera):
    """A tactile fingertip as a camera; its frames are uint8 (height, width, 3), RGB.

    It opens the fingertip only: no gripper and no arm of the rig is connected.
    """

    def __init__(self, config: LsdsCameraConfig) -> None:
        super().__init__(config)
        self.config = config
        self._tip: Fingertip | None = None
        self._capture: Capture | None = None

    def __str__(self) -> str:
        return f"LsdsCamera({self.config.rig or self.config.sensor})"

    @property
    def is_connected(self) -> bool:
        """Whether the fingertip is open."""
        return self._capture is not None

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        """Return the installed sensor backends; `id` is the value for the option `sensor`."""
        return [{"name": f"lsds {name}", "type": "lsds", "id": name} for name in PluginHost().names("sensor")]

    def connect(self, warmup: bool = True) -> None:
        """Open the fingertip and start reading; `warmup` waits for the first frame.

        Raises ConnectionError if it is open, ValueError if size or rate differ from the sensor's, ConfigError,
        BringUpError, TimeoutError; the fingertip is closed then.
        """
        if self.is_connected:
            raise ConnectionError(f"{self} is already connected; call disconnect() first")
        config = self.config
        tip = Fingertip(config.rig, config.finger, config.sensor, config.options, config.overrides)
        tip.connect()
        try:
            self._adopt(tip)
        except BaseException:
            tip.close()
            raise
        self._tip, self._capture = tip, Capture(tip)
        self._capture.start()
        if warmup:
            try:
                self._capture.next(READ_S)
            except BaseException:
                self.disconnect()
                raise

    def read(self, color_mode: object = None) -> NDArray[np.uint8]:
        """Wait for the next frame and return it. `color_mode` exists for LeRobot 0.4: None or "rgb".

        Raises ConnectionError, TimeoutError, ValueError for another colour mode.
        """
        mode = getattr(color_mode, "value", color_mode)
        if mode not in (None, "rgb"):
            raise ValueError(f"{self}: colour mode {mode!r} is not supported; use 'rgb'")
        return self._open().next(READ_S, after_now=True)

    def async_read(self, timeout_ms: float = 200) -> NDArray[np.uint8]:
        """Return the newest frame that was not returned yet; wait for it up to `timeout_ms`.

        Raises ConnectionError, TimeoutError.
        """
        return self._open().next(timeout_ms / 1e3)

    def read_latest(self, max_age_ms: int = 500) -> NDArray[np.uint8]:
        """Return the newest frame at once. Raises ConnectionError, RuntimeError, TimeoutError if it is too old."""
        return self._open().latest(max_age_ms / 1e3)

    def disconnect(self) -> None:
        """Stop reading and close the fingertip. Raises ConnectionError if it is not open."""
        capture, tip = self._open(), self._tip
        self._capture = self._tip = None
        capture.stop()
        if tip is not None:
            tip.close()

    def _open(self) -> Capture:
        if self._capture is None:
            raise ConnectionError(f"{self} is not connected; call connect() first")
        return self._capture

    def _adopt(self, tip: Fingertip) -> None:
        """Take size and rate of the sensor. Raises ValueError if others were asked for."""
        spec = tip.spec
        for name, own in (("width", spec.width_px), ("height", spec.height_px)):
            asked = getattr(self.config, name)
            if asked not in (None, own):
                raise ValueError(f"{self}: {name} is {asked}, the sensor delivers {own}; set {name} to {own}")
        fps = self.config.fps
        if fps is not None and abs(fps - spec.rate_hz) > RATE_SHARE * spec.rate_hz:
            raise ValueError(f"{self}: fps is {fps}, the sensor delivers {spec.rate_hz:g}; set fps to that")
        self.width, self.height = spec.width_px, spec.height_px
        self.fps = round(spec.rate_hz) if fps is None else fps
