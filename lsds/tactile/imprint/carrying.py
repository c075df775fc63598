"""How the gel's surface moves between two frames, everywhere, from the dots that both show."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.tactile.imprint.relief import Plane

    Floats = NDArray[np.float64]

#: The motion is worked out at nodes this far apart, px, and linear between them.
NODE_PX = 32
#: A dot's say at a distance is a Gaussian with this standard deviation, in pitches.
REACH = 0.8
#: Quantile of the dots' motions that tells whether the gel moves.
FASTEST = 0.9
#: Fewer dots than this do not tell how the gel moves.
LEAST_DOTS = 6
#: Say of the even motion (affine) beside that of the dots around a node.
_EVEN = 0.05


class CarriedGel:
    """Motion of the gel from one frame to the next, px of the image. Affine, plus what the dots around deviate from it.

    Interpolated by a Gaussian mean (Nadaraya 1964, Watson 1964).
    """

    def __init__(self, position: Floats, moved: Floats, pitch_px: float, image_size: tuple[int, int]) -> None:
        """`position` (n, 2) and `moved` (n, 2) of at least `LEAST_DOTS` dots; `image_size` (width, height)."""
        node_x, node_y, grid = _grid(image_size)
        count, columns = len(position), len(node_x)
        table = np.ones((5, count))
        table[1:3], table[3:] = position.T, moved.T
        even = _even(table)
        near = np.empty((columns + len(node_y), count))
        np.subtract(node_x[:, None], table[1], out=near[:columns])
        np.subtract(node_y[:, None], table[2], out=near[columns:])
        near *= near
        near *= -0.5 / (REACH * pitch_px) ** 2
        np.exp(near, out=near)
        # A Gaussian of a distance is the product of those along x and y.
        near_x, near_y = near[:columns], near[columns:]
        table[3:] -= even @ table[:3]
        # The deviations and, in the row of ones, how much say the dots have.
        rest = table[[3, 4, 0]]
        deviation = ((near_y * rest[:, None]).reshape(-1, count) @ near_x.T).reshape(3, -1)
        nodes = deviation[:2] / (deviation[2] + _EVEN)
        nodes += even @ grid
        self._nodes = nodes.T.astype(np.float32, order="C").reshape(len(node_y), columns, 2)
        #: How far the fastest tenth of the dots has moved at least, px.
        self.fastest_px = fastest(moved)

    def everywhere(self, shape: tuple[int, ...], scale: float) -> Plane:
        """Return the motion (h, w, 2), in pixels of which each is `scale` px of the image."""
        rows, columns = shape
        step = scale / NODE_PX
        # Pixel centres to nodes: an affine look-up, which resizing with its own idea of the borders is not.
        nodes = cv2.warpAffine(
            self._nodes,
            np.array([[step, 0.0, 0.0], [0.0, step, 0.0]]),
            (columns, rows),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )
        return np.asarray(nodes / np.float32(scale), np.float32)

    def at(self, x: Plane, y: Plane, scale: float = 1.0) -> Plane:
        """Return the motion (n, 2) at positions (n,), all in pixels of which each is `scale` px of the image."""
        per_node = np.float32(scale / NODE_PX)
        nodes = self._nodes if scale == 1.0 else self._nodes * np.float32(1 / scale)
        found = cv2.remap(nodes, x * per_node, y * per_node, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(found, np.float32).reshape(-1, 2)


@lru_cache(maxsize=8)
def _grid(image_size: tuple[int, int]) -> tuple[Floats, Floats, Floats]:
    """Return where the nodes are, along x and along y, and (3, n) of each: one, x and y."""
    along_x, along_y = (NODE_PX * np.arange(length // NODE_PX + 2, dtype=np.float64) for length in image_size)
    grid = np.ones((3, len(along_y), len(along_x)))
    grid[1], grid[2] = along_x, along_y[:, None]
    return along_x, along_y, grid.reshape(3, -1)


def _even(table: Floats) -> Floats:
    """Return the affine motion (2, 3), by one, x and y, that fits a table (5, n) of one, position and motion best."""
    sums, by_x, by_y, *_ = (table @ table.T).tolist()
    x, y, *mean = (part / sums[0] for part in sums[1:])
    xx, xy, *along_x = (part - x * whole for part, whole in zip(by_x[1:], sums[1:], strict=True))
    _, yy, *along_y = (part - y * whole for part, whole in zip(by_y[1:], sums[1:], strict=True))
    # Dots in one line tell nothing across it.
    xx, yy = xx + 1.0, yy + 1.0
    both = xx * yy - xy * xy
    even = np.empty((2, 3))
    for k in range(2):
        slope_x, slope_y = (yy * along_x[k] - xy * along_y[k]) / both, (xx * along_y[k] - xy * along_x[k]) / both
        even[k] = mean[k] - slope_x * x - slope_y * y, slope_x, slope_y
    return even


def fastest(moved: Floats) -> float:
    """Return how far the fastest tenth of the dots has moved at least, in the unit of their motions (n, 2)."""
    squared = moved[:, 0] ** 2
    squared += moved[:, 1] ** 2
    squared.sort()
    return math.sqrt(squared[int(FASTEST * (len(squared) - 1))])
