"""A fake of OpenCV's capture: it generates the pictures of a DIGIT in real time, lying on their side."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from lsds.clock import WallClock
from numpy.typing import NDArray

from lsds_digit import camera as camera_module
from lsds_digit import find
from lsds_digit.camera import Camera
from lsds_digit.options import Options
from lsds_digit.sensor import DigitSensor

UPRIGHT_RED = (slice(0, 40), slice(0, 60))
"""Rows and columns of a red patch at the top left of the upright QVGA image."""


class FakeCapture:
    """Has the methods of `cv2.VideoCapture` that the driver calls. Its fields are the faults of a camera."""

    def __init__(self) -> None:
        self.set_to: dict[int, float] = {}
        self.opens = self.has_leds = True
        self.unplugged = self.hangs = False
        self.raises = False
        self.stamp_age_s: float | None = None
        self.size: tuple[int, int] | None = None
        self.released = 0
        self._next_s = 0.0
        self._noise = np.random.default_rng(1)

    def isOpened(self) -> bool:
        return self.opens

    def set(self, control: int, value: float) -> bool:
        if control == cv2.CAP_PROP_ZOOM and not self.has_leds:
            return False
        self.set_to[control] = value
        return True

    def get(self, control: int) -> float:
        assert control == cv2.CAP_PROP_POS_MSEC
        return 0.0 if self.stamp_age_s is None else (time.monotonic() - self.stamp_age_s) * 1e3

    def read(self) -> tuple[bool, NDArray[np.uint8] | None]:
        while self.hangs:
            time.sleep(0.01)
        if self.raises:
            raise cv2.error("the driver is gone")
        if self.unplugged:
            return False, None
        now_s = time.monotonic()
        self._next_s = max(self._next_s + 1 / self.set_to[cv2.CAP_PROP_FPS], now_s - 0.1)
        time.sleep(max(0.0, self._next_s - now_s))
        return True, self._picture()

    def release(self) -> None:
        self.released += 1

    def _picture(self) -> NDArray[np.uint8]:
        given = self.set_to[cv2.CAP_PROP_FRAME_WIDTH], self.set_to[cv2.CAP_PROP_FRAME_HEIGHT]
        width, height = self.size or (int(given[0]), int(given[1]))
        upright = np.full((width, height, 3), 90, np.uint8)
        rows, columns = UPRIGHT_RED
        upright[rows, columns] = (20, 20, 220)  # red, as OpenCV orders the channels
        picture = cv2.rotate(upright, cv2.ROTATE_90_CLOCKWISE)
        return np.asarray(picture + self._noise.integers(0, 5, picture.shape, np.uint8), np.uint8)


class Desk:
    """The connected DIGITs and the drivers that were built on them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.capture = FakeCapture()
        self.opened: list[str] = []
        self.sensors: list[DigitSensor] = []

    def plug(self, name: str) -> None:
        """Link a device file as udev does."""
        (self.folder / f"usb-{name}-video-index0").touch()
        (self.folder / f"usb-{name}-video-index1").touch()

    def open(self, path: str) -> Any:
        self.opened.append(path)
        return self.capture

    def driver(self, **options: Any) -> DigitSensor:
        """Return a new driver."""
        given = Options(**options)
        clock = WallClock()
        self.sensors.append(DigitSensor(Camera("digit", given, clock, self.folder), given, clock))
        return self.sensors[-1]

    def connected(self, **options: Any) -> DigitSensor:
        """Return a connected driver."""
        sensor = self.driver(**options)
        sensor.connect()
        return sensor


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Desk]:
    """One connected DIGIT with the serial number D20790, next to another camera."""
    desk = Desk(tmp_path)
    desk.plug("Facebook_DIGIT_D20790")
    desk.plug("Acme_Webcam_77")
    monkeypatch.setattr(camera_module, "open_capture", desk.open)
    # A driver that the host builds looks in the folder of this machine.
    monkeypatch.setattr(camera_module.Camera.__init__, "__defaults__", (tmp_path,))
    monkeypatch.setattr(find, "BY_ID", tmp_path)
    yield desk
    desk.capture.hangs = False
    for sensor in desk.sensors:
        sensor.close()
