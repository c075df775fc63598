"""Surfaces from height map files, measured on a real object or drawn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.errors import DataError
from lsds_mocks.gel.shapes import Flat
from lsds_mocks.objects.relief import Relief

if TYPE_CHECKING:
    from numpy.typing import NDArray


_MOST_SAMPLES = 32_000
"""Maximum number of samples along an axis that OpenCV can look up."""
_HIGHEST_M = 0.05
"""Maximum height difference within a height map, m; chosen, since a greater one suggests another unit."""


def read_heights(path: Path, range_mm: float) -> NDArray[np.float64]:
    """Return heights (rows, columns) in metres from a `.npy` in metres, or a grey image (black 0, white `range_mm`).

    Raises DataError if the file cannot be read, is not a height map, or holds values that are not finite.
    """
    if not path.is_file():
        raise DataError(f"{path}: no such height map (cell.simulated.height_map; relative to {Path.cwd()})")
    if path.suffix == ".npy":
        try:
            heights = np.load(path, allow_pickle=False)
        except (OSError, ValueError, EOFError) as error:
            raise DataError(f"{path}: not a NumPy array; write one with numpy.save, heights in metres") from error
    else:
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        if image is None:
            raise DataError(f"{path}: not a height map; give a .npy of metres or a grey image")
        if image.ndim != 2:
            raise DataError(f"{path}: a height map is a grey image, this one has {image.shape[2]} channels")
        if image.dtype not in (np.uint8, np.uint16):
            raise DataError(f"{path}: its values are {image.dtype}; give 8 or 16 bits of grey, or a .npy of metres")
        white = 65535.0 if image.dtype == np.uint16 else 255.0
        heights = image / white * range_mm * 1e-3
    heights = np.asarray(heights)
    if heights.ndim != 2 or min(heights.shape) < 2:
        raise DataError(f"{path}: a height map has two axes of at least 2 samples, not shape {heights.shape}")
    if not (np.issubdtype(heights.dtype, np.number) and np.isrealobj(heights) and np.isfinite(heights).all()):
        raise DataError(f"{path}: heights must be finite real numbers")
    if max(heights.shape) > _MOST_SAMPLES:
        raise DataError(f"{path}: {heights.shape} samples are too many: at most {_MOST_SAMPLES} along an axis")
    if np.ptp(heights) > _HIGHEST_M:
        raise DataError(
            f"{path}: its relief is {np.ptp(heights):g} m high: heights are in metres, at most {_HIGHEST_M:g}"
        )
    return heights.astype(np.float64)


def height_map(path: Path, *, mm_per_px: float, range_mm: float = 1.0) -> Relief:
    """Return a flat face with the heights of a file, row 0 at the smallest y; it repeats beyond its borders."""
    heights = read_heights(path, range_mm)
    return Relief(Flat(), (heights.max() - heights).astype(np.float32), mm_per_px * 1e-3)
