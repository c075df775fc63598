"""Marker positions of a pad in the undeformed image."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

WIDTH_PX = 320
"""Width of the image, px."""
HEIGHT_PX = 240
"""Height of the image, px."""
CENTRE_PX = np.array([(WIDTH_PX - 1) / 2, (HEIGHT_PX - 1) / 2])

PadName = Literal["7x9", "8x10", "5x7"]
PITCH_PX: dict[PadName, tuple[float, float]] = {"7x9": (31.8, 31.2), "8x10": (29.0, 27.8), "5x7": (42.0, 42.0)}
"""Distance between neighbouring markers at the image's centre; 5x7 is the inner part of a 7x9, magnified."""
PINCUSHION_PX2 = 1.57e-6
"""Pincushion constant c of r' = r (1 + c r^2): the pitch grows from 31.7 px at the centre to 34.3 px at the edge."""


def shape_of(pad: PadName) -> tuple[int, int]:
    """Return (rows, columns)."""
    rows, columns = pad.split("x")
    return int(rows), int(columns)


def scale_of(pad: PadName, mm_per_px: float) -> float:
    """Return metres per pixel; the zoomed pad shows the same 2 mm pitch over more pixels."""
    return mm_per_px * 1e-3 * (PITCH_PX["7x9"][0] / PITCH_PX["5x7"][0] if pad == "5x7" else 1.0)


def dot_positions(
    pad: PadName, variation: float, rng: np.random.Generator, pitch_of_mean: tuple[float, float] = (1.0, 1.0)
) -> NDArray[np.float64]:
    """Return marker centres (N, 2) in pixels, row by row; x right, y down, pixel centres at integers.

    `variation` scales the differences between gels: offset and rotation of the print, and the error of each marker.
    `pitch_of_mean` is this gel's pitch along x and y, relative to the mean gel.
    """
    rows, columns = shape_of(pad)
    pitch = np.array(PITCH_PX[pad]) * pitch_of_mean
    column, row = np.meshgrid(np.arange(columns) - (columns - 1) / 2, np.arange(rows) - (rows - 1) / 2)
    xy = np.stack([column.ravel(), row.ravel()], axis=1) * pitch
    xy *= 1 + PINCUSHION_PX2 * (xy**2).sum(axis=1, keepdims=True)
    angle = variation * np.deg2rad(0.3) * rng.standard_normal()
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    offset = variation * 1.0 * rng.standard_normal(2)
    return np.asarray(xy @ turn + offset + variation * 0.15 * rng.standard_normal(xy.shape) + CENTRE_PX)
