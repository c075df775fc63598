"""Faults of a camera's images: each is a function of an image."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from lsds.contracts import Frame
from lsds_mocks.faults.made import fault
from lsds_mocks.faults.plan import Around, Plan

Image = NDArray[np.uint8]
Change = Callable[[Image, "Shown"], NDArray[Any]]
FLICKER_HZ = 7.0
"""Frequency at which a flickering image changes its brightness, Hz; chosen."""
GREY_LEVEL = 128
"""Grey level of the missing part of a torn image, the middle of 0 to 255."""
TILE_GRID = (6, 8)
"""Rows and columns of the tiles into which `stuck_dots` divides the image."""


class Shown(Around):
    """A sensor whose images are changed while the fault is on. `before` is the last image without it."""

    def __init__(self, part: Any, plan: Plan, change: Change) -> None:
        super().__init__(part, plan)
        self.before: Image | None = None
        self._change = change
        self._last: tuple[Frame, Frame] | None = None
        self.plan = plan

    def read(self) -> Frame:
        """Return the newest frame, changed while the fault is on."""
        frame: Frame = self._part.read()
        if self._last is not None and self._last[0] is frame:
            return self._last[1]
        seen = frame
        if self.plan.on:
            seen = replace(frame, image=self._change(frame.image, self))
        else:
            self.before = frame.image
        self._last = frame, seen
        return seen


def _scaled(image: Image, gain: Any) -> Image:
    return np.clip(np.rint(image * np.asarray(gain, np.float32)), 0, 255).astype(np.uint8)


def _faded(channel: int) -> Change:
    def change(image: Image, shown: Shown) -> Image:
        gain = np.ones(3, np.float32)
        gain[channel] = 1 - shown.plan.level
        return _scaled(image, gain)

    return change


def _dark(image: Image, shown: Shown) -> Image:
    return _scaled(image, 1 - shown.plan.level)


def _bright(image: Image, shown: Shown) -> Image:
    return _scaled(image, shown.plan.level)


def _gain(image: Image, shown: Shown) -> Image:
    return _scaled(image, 1 + shown.plan.level * shown.plan.since_s)


def _flicker(image: Image, shown: Shown) -> Image:
    return _scaled(image, 1 + shown.plan.level * math.sin(2 * math.pi * FLICKER_HZ * shown.plan.since_s))


def _noise(image: Image, shown: Shown) -> Image:
    noise = shown.plan.rng.normal(0, shown.plan.level, image.shape)
    return np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)


def _blur(image: Image, shown: Shown) -> NDArray[Any]:
    return cv2.GaussianBlur(image, (0, 0), shown.plan.level)


def _by(image: Image, px: float) -> NDArray[Any]:
    return cv2.warpAffine(
        image, np.array([[1, 0, px], [0, 1, 0]], np.float32), image.shape[1::-1], borderMode=cv2.BORDER_REPLICATE
    )


def _moved(image: Image, shown: Shown) -> NDArray[Any]:
    return _by(image, shown.plan.level)


def _loose_gel(image: Image, shown: Shown) -> NDArray[Any]:
    return _by(image, min(shown.plan.level * shown.plan.since_s, image.shape[1]))


def _torn(image: Image, shown: Shown) -> Image:
    changed = image.copy()
    changed[round((1 - shown.plan.level) * len(image)) :] = GREY_LEVEL
    return changed


def _bgr(image: Image, shown: Shown) -> Image:
    return np.ascontiguousarray(image[:, :, ::-1])


def _small(image: Image, shown: Shown) -> Image:
    return np.ascontiguousarray(image[::2, ::2])


def _float(image: Image, shown: Shown) -> NDArray[Any]:
    return image.astype(np.float32) / 255


def _scar(image: Image, shown: Shown) -> NDArray[Any]:
    height, width = image.shape[:2]
    return cv2.line(
        image.copy(), (width // 5, 0), (width // 2, height - 1), (210, 210, 205), round(shown.plan.level), cv2.LINE_AA
    )


def _stuck_dots(image: Image, shown: Shown) -> NDArray[Any]:
    """Keep the last image without the fault in a share of the tiles, always the same."""
    if shown.before is None:
        return image
    tiles = (
        np.random.default_rng(1).permutation(TILE_GRID[0] * TILE_GRID[1])
        < shown.plan.level * TILE_GRID[0] * TILE_GRID[1]
    )
    mask = cv2.resize(tiles.reshape(TILE_GRID).astype(np.uint8), image.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    return np.where(mask[:, :, None] > 0, shown.before, image)


dark = fault(partial(Shown, change=_dark), "images:dark")
bright = fault(partial(Shown, change=_bright), "images:bright")
no_red = fault(partial(Shown, change=_faded(0)), "images:no_red")
no_green = fault(partial(Shown, change=_faded(1)), "images:no_green")
no_blue = fault(partial(Shown, change=_faded(2)), "images:no_blue")
gain = fault(partial(Shown, change=_gain), "images:gain")
flicker = fault(partial(Shown, change=_flicker), "images:flicker")
noise = fault(partial(Shown, change=_noise), "images:noise")
blur = fault(partial(Shown, change=_blur), "images:blur")
moved = fault(partial(Shown, change=_moved), "images:moved")
torn = fault(partial(Shown, change=_torn), "images:torn")
bgr = fault(partial(Shown, change=_bgr), "images:bgr")
small = fault(partial(Shown, change=_small), "images:small")
as_float = fault(partial(Shown, change=_float), "images:as_float")
scar = fault(partial(Shown, change=_scar), "images:scar")
stuck_dots = fault(partial(Shown, change=_stuck_dots), "images:stuck_dots")
loose_gel = fault(partial(Shown, change=_loose_gel), "images:loose_gel")
