"""Features of a single image, used as controls: a single image cannot show slip.

The features are colours on a coarse grid and the strength of the surface relief. They identify gel, light and object.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.contracts import Frame
from lsds.tactile.imprint.relief import ReliefMaker

if TYPE_CHECKING:
    from numpy.typing import NDArray

LOOKS = tuple(f"look_{index}" for index in range(16))
"""Columns of a dataset, defined in the first and last row of a recording: colours (R, G, B) of the four quarters, and
the RMS relief of each."""


def look_of(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the numbers (16,) of an image (h, w, 3)."""
    colours = cv2.resize(image, (2, 2), interpolation=cv2.INTER_AREA).astype(np.float32).ravel()
    relief = ReliefMaker().relief(Frame(image, 0, 0))
    squares = cv2.resize((relief.curvature * relief.weight) ** 2, (2, 2), interpolation=cv2.INTER_AREA)
    return np.concatenate([colours, np.sqrt(np.asarray(squares, np.float32)).ravel()])
