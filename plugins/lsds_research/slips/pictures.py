"""Pictures for labelling: a kymograph of the whole recording, and strips of frames."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.slips.recording_view import GelStep, RecordingView

    Image = NDArray[np.uint8]

TILE_PX = (200, 150)
"""Size of a tile of a strip, px."""
STRIP = 24
"""Number of frames of a strip."""
IN_A_ROW = 8
"""Number of frames in a row of a strip."""
DOTS_ENLARGED = 5
"""Magnification of the lines that show the motion of markers since the last frame."""
CONTRAST = 2500.0
"""Grey levels per unit of curvature."""
GRID_PX = 40
"""Distance of the lines across a relief, px of the image."""
_PICTURE_WIDTH_PX = 1300
"""Width of a picture, px."""
_BAND_PX = 5
"""Half-width of the band of a relief that is averaged, px."""
_TRACE_PX = 150
"""Height of the traces below a strip, px."""
_ANGLES = 120
"""Number of angles at which the relief around the contact is sampled."""
_RADIUS = 40
"""Radius up to which it is sampled, px."""
_WHITE_RGB = (255, 255, 255)
"""White, RGB."""
_YELLOW_RGB = (255, 255, 0)
"""Yellow, RGB."""
_RED_RGB = (255, 0, 0)
"""Red, RGB."""
_BLACK_RGB = (0, 0, 0)
"""Black, RGB."""
_TRACES = ((0, 0, 255), (0, 160, 0), (255, 0, 0))
"""Colours of the traces of the gel's motion, RGB: x blue, y green, turn red."""


def strip(
    seen: RecordingView, first: int, last: int, *, size: tuple[int, int] = TILE_PX, across: int = IN_A_ROW
) -> Image:
    """Return a picture (h, w, 3) of frames `first` to `last`: images above, reliefs fixed to the gel below.

    The relief is shifted by the gel's motion since `first`, so that an object that sticks stays on the lines.
    """
    place = seen.centre(first, last)
    reliefs, steps = seen.gel_fixed(first, last, place)
    tiles = [
        np.vstack([_image_tile(seen, number, size), _relief_tile(seen, relief, step, size)])
        for number, relief, step in zip(range(first, last + 1), reliefs, steps, strict=True)
    ]
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % across)
    return np.vstack([np.hstack(tiles[start : start + across]) for start in range(0, len(tiles), across)])


def _image_tile(seen: RecordingView, number: int, size: tuple[int, int]) -> Image:
    image = seen.images[number]
    tile = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    scale = size[0] / image.shape[1]
    position, moved = seen.dots[number]
    for start, step in zip(position * scale, moved * scale * DOTS_ENLARGED, strict=True):
        if np.hypot(*step) > 1.0:
            begin, end = np.rint(start).astype(int), np.rint(start + step).astype(int)
            cv2.line(tile, begin.tolist(), end.tolist(), _WHITE_RGB, 1, cv2.LINE_AA)
    _write(tile, str(number), (3, 13))
    return tile


def _relief_tile(seen: RecordingView, relief: NDArray[np.float32], step: GelStep, size: tuple[int, int]) -> Image:
    tile = np.asarray(cv2.resize(_grey(relief), size, interpolation=cv2.INTER_LINEAR), np.uint8)
    scale = size[0] / seen.images.shape[2]
    # A tile has one shape, whatever the image's: the lines lie where they would on an image of the tile's shape.
    for at in np.arange(GRID_PX * scale, tile.shape[1], GRID_PX * scale).astype(int).tolist():
        tile[:, at] = tile[:, at] * 0.75 + 15
    for at in np.arange(GRID_PX * scale, tile.shape[0], GRID_PX * scale).astype(int).tolist():
        tile[at] = tile[at] * 0.75 + 15
    text = "gel ?" if math.isnan(step.x) else f"gel {step.x:.1f} {step.y:.1f} {math.degrees(step.turn):.1f}d"
    _write(tile, text, (3, size[1] - 4), _YELLOW_RGB)
    return tile


def kymograph(seen: RecordingView) -> Image:
    """Return a picture (h, w, 3) of the whole recording, time from left to right.

    Three bands show the relief in coordinates fixed to the gel: a cut along x, one along y, and one around the
    contact's centre (clockwise downwards). An object that sticks is straight. Below: the gel's motion in each frame, x
    blue, y green and turn red, and in black the strength of the relief.
    """
    count = len(seen)
    wide = max(2, min(8, _PICTURE_WIDTH_PX // count))
    # The first frames often show an earlier contact.
    place = seen.centre(min(10, count // 4), count - 1)
    reliefs, steps = seen.gel_fixed(0, count - 1, place)
    x, y = int(place[0]), int(place[1])
    gap = np.full(2, 1.0, np.float32)
    polar = cv2.WARP_POLAR_LINEAR | cv2.WARP_FILL_OUTLIERS
    columns = []
    for relief in reliefs:
        around = cv2.warpPolar(relief, (_RADIUS, _ANGLES), place, _RADIUS, polar)
        along_x = relief[max(0, y - _BAND_PX) : y + _BAND_PX + 1].mean(axis=0)
        along_y = relief[:, max(0, x - _BAND_PX) : x + _BAND_PX + 1].mean(axis=1)
        columns.append(np.concatenate([along_x, gap, along_y, gap, around[:, _RADIUS // 5 :].mean(axis=1)]))
    bands = cv2.resize(_grey(np.array(columns).T), None, fx=wide, fy=2, interpolation=cv2.INTER_NEAREST)
    picture = np.vstack([np.asarray(bands, np.uint8), _traces(seen, steps, wide)])
    for number in range(0, count, 10):
        at = number * wide
        cv2.line(picture, (at, 0), (at, 14 if number % 50 == 0 else 6), _YELLOW_RGB, 1)
        if number % 50 == 0:
            _write(picture, str(number), (at + 2, 12), _YELLOW_RGB)
    return picture


def _traces(seen: RecordingView, steps: list[GelStep], wide: int) -> Image:
    count = len(seen)
    picture = np.full((_TRACE_PX, count * wide, 3), 255, np.uint8)
    middle = np.arange(count) * wide + wide // 2
    scaled = np.nan_to_num(np.array(steps)) * (8.0, 8.0, 8 * 40.0)
    strength = np.abs(seen.relief).mean(axis=(1, 2)) * 9000
    lines = [(0.4 * _TRACE_PX - scaled[:, axis], colour) for axis, colour in enumerate(_TRACES)]
    for height, colour in [*lines, (_TRACE_PX - strength, _BLACK_RGB)]:
        points = np.column_stack([middle, np.clip(height, 0, _TRACE_PX - 1)]).astype(np.int32)
        cv2.polylines(picture, [points[:, None]], False, colour, 1)
    for number in range(1, count):
        if math.isnan(steps[number].x):
            cv2.line(picture, (number * wide, 0), (number * wide, 8), _RED_RGB, 2)
    return picture


def _grey(relief: NDArray[np.float32]) -> Image:
    grey = np.clip(128 + CONTRAST * relief, 0, 255).astype(np.uint8)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2RGB), np.uint8)


def _write(picture: Image, text: str, at: tuple[int, int], colour: tuple[int, int, int] = _WHITE_RGB) -> None:
    cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.4, colour, 1, cv2.LINE_AA)
