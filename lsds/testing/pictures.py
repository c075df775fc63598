"""Checks of the content of tactile images: light, colours, and the printed markers."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from lsds.contracts.values import Frame
from lsds.tactile.views import viewed
from lsds.testing.bench import Bench
from lsds.testing.outcomes import NotApplicable

BLACK_FRAME_LEVEL = 10
"""Maximum grey level of a black frame."""
TILT = 0.05
"""Minimum difference of brightness between top and bottom that is evidence of a lamp, as a share of their sum."""
_CAMERA_SETTLED_S = 0.6
"""Time after which the camera's exposure counts as settled, s; chosen."""


def check_frames_are_not_black(bench: Bench) -> None:
    """Some frame of the first second has light in it."""
    brightest = 0
    with bench.device() as device:
        for frame in bench.samples(device, 1.0):
            brightest = max(brightest, int(np.max(frame.image)))
    assert brightest >= BLACK_FRAME_LEVEL, (
        f"all frames of the first second are black: the brightest pixel is {brightest}; check exposure and lamps"
    )


def check_colours_are_rgb(bench: Bench) -> None:
    """Under a red lamp below and a blue one above the image, red is the first channel (`PhotometricCalibration`)."""
    image = _settled(bench).image.astype(np.float64)
    quarter = max(1, image.shape[0] // 4)
    top, bottom = image[:quarter].mean((0, 1)), image[-quarter:].mean((0, 1))
    tilt = (bottom - top) / np.maximum(bottom + top, 1.0)
    first, last = float(tilt[0]), float(tilt[2])
    if min(abs(first), abs(last)) < TILT or first * last > 0:
        raise NotApplicable("the image shows no red and blue lamps at opposite sides")
    assert first > 0 > last, (
        f"the first channel is brighter above by {-first:.0%} and the third below by {last:.0%}, where red comes from "
        "below and blue from above: the image is BGR, or upside down; convert it to RGB"
    )


def check_markers_form_the_pad(bench: Bench) -> None:
    """The markers in the image of the untouched gel form the declared pad, rows by columns."""
    frame = _settled(bench)
    with bench.device() as device:
        pad = device.spec.pad
    if pad is None:
        raise NotApplicable("the spec declares no markers")
    centres = _markers(frame)
    rows, columns = pad
    found = len(centres)
    assert 0.75 * rows * columns <= found <= 1.25 * rows * columns + 2, (
        f"the spec declares {rows} x {columns} = {rows * columns} markers, and the image shows {found}; "
        "set pad to (rows, columns) as printed, None for a gel without markers"
    )
    shown = _lines(centres[:, 1]), _lines(centres[:, 0])
    if abs(shown[0] - rows) > 1 or abs(shown[1] - columns) > 1:
        swapped = abs(shown[0] - columns) <= 1 and abs(shown[1] - rows) <= 1
        assert not swapped, (
            f"the spec declares a pad of {rows} rows and {columns} columns, and the image shows {shown[0]} rows and "
            f"{shown[1]} columns; pad is (rows, columns)"
        )


def _settled(bench: Bench) -> Frame:
    """Return a frame of the untouched gel after the camera's exposure has settled."""
    with bench.device() as device:
        frames: list[Frame] = list(bench.samples(device, _CAMERA_SETTLED_S))
    return frames[-1]


def _markers(frame: Frame) -> NDArray[np.float64]:
    """Return the centres (N, 2) of dark spots of a marker's size, in pixels."""
    count, _, stats, centres = cv2.connectedComponentsWithStats(viewed(frame).dark)
    if count < 2:
        return np.empty((0, 2))
    sizes = stats[1:, cv2.CC_STAT_AREA]
    typical = float(np.median(sizes))
    return np.asarray(2 * centres[1:][(sizes > 0.3 * typical) & (sizes < 3 * typical)], np.float64)


def _lines(places: NDArray[np.float64]) -> int:
    """Return the number of lines that the places form along one axis."""
    ordered = np.sort(places)
    steps = np.diff(ordered)
    widest = float(np.max(steps, initial=0.0))
    return 1 + int(np.count_nonzero(steps > max(0.5 * widest, 2.0)))


PICTURE_CHECKS = (check_frames_are_not_black, check_colours_are_rgb, check_markers_form_the_pad)
