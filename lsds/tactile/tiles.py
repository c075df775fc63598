"""Samples an image: some of its rows, each divided into tiles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

TILES_PER_ROW = 8
"""Number of tiles per row; chosen."""


def tiles_of(image: NDArray[np.uint8], row_step_px: int, first_row: int = 0) -> NDArray[np.uint8] | None:
    """Return the tiles (n, values) of every `row_step_px`-th row of an image (height, width, 3) of uint8, as a copy.

    Columns that do not fill a tile are left out. None for any other array, and for an image that holds no tile.
    """
    if not (isinstance(image, np.ndarray) and image.dtype == np.uint8 and image.ndim == 3 and image.shape[2] == 3):
        return None
    rows = image[first_row::row_step_px, : image.shape[1] // TILES_PER_ROW * TILES_PER_ROW]
    return rows.reshape(len(rows) * TILES_PER_ROW, -1).copy() if rows.size else None
