"""Motion of the gel's surface between two frames, interpolated from the markers that both show."""

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

#: Distance of the nodes at which the motion is computed, px; it is linear between them.
NODE_PX = 32
#: Standard deviation of the Gaussian weight of a marker by distance, in pitches.
REACH = 0.8
#: Quantile of the markers' motions that decides whether the gel moves.
FASTEST = 0.9
#: Minimum number of markers from which the gel's motion can be computed.
LEAST_DOTS = 6
#: Weight of the affine motion at a node, relative to one marker at the node.
_AFFINE_WEIGHT = 0.05


class CarriedGel:
    """Motion of the gel from one frame to the next, px of the image.

    It is the best affine motion plus the deviation of the markers nearby, interpolated by a Gaussian mean (Nadaraya
    1964, Watson 1964).
    """

    def __init__(
        self,
        position: Floats,
        moved: Floats,
        pitch_px: float,
        image_size: tuple[int, int],
        *,
        compiled: bool = False,
    ) -> None:
        """`position` (n, 2) and `moved` (n, 2) of at least `LEAST_DOTS` markers; `image_size` (width, height).

        `compiled` is whether compiled functions compute the motion.
        """
        #: Minimum motion of the fastest tenth of the markers, px.
        self.fastest_px = fastest(moved)
        node_x, node_y, grid = _grid(image_size)
        if compiled:
            from lsds.tactile.compiled.carrying import nodes_of

            self._nodes = nodes_of(position, moved, node_x, node_y, REACH * pitch_px, _AFFINE_WEIGHT)
            return
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
        # The deviations and, in the row of ones, the sum of the weights.
        rest = table[[3, 4, 0]]
        deviation = ((near_y * rest[:, None]).reshape(-1, count) @ near_x.T).reshape(3, -1)
        nodes = deviation[:2] / (deviation[2] + _AFFINE_WEIGHT)
        nodes += even @ grid
        self._nodes = nodes.T.astype(np.float32, order="C").reshape(len(node_y), columns, 2)

    def everywhere(self, shape: tuple[int, ...], scale: float) -> Plane:
        """Return the motion (h, w, 2), in pixels that are `scale` image pixels wide."""
        rows, columns = shape
        step = scale / NODE_PX
        # An affine look-up maps pixel centres to nodes exactly; a resize would shift them at the borders.
        nodes = cv2.warpAffine(
            self._nodes,
            np.array([[step, 0.0, 0.0], [0.0, step, 0.0]]),
            (columns, rows),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )
        return np.asarray(nodes / np.float32(scale), np.float32)

    def at(self, x: Plane, y: Plane, scale: float = 1.0) -> Plane:
        """Return the motion (n, 2) at positions (n,), all in pixels that are `scale` image pixels wide."""
        per_node = np.float32(scale / NODE_PX)
        nodes = self._nodes if scale == 1.0 else self._nodes * np.float32(1 / scale)
        found = cv2.remap(nodes, x * per_node, y * per_node, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(found, np.float32).reshape(-1, 2)

    def places(self, table: Plane, scale: float, centre: tuple[float, float]) -> tuple[Plane, float]:
        """Return the carried positions (2, n) of edges (7, n) about a centre, and their radius of gyration.

        All are in pixels that are `scale` image pixels wide. For compiled registrations.
        """
        from lsds.tactile.compiled.registration import places_of

        places: tuple[Plane, float] = places_of(table, self._nodes, scale / NODE_PX, scale, *centre)
        return places


@lru_cache(maxsize=8)
def _grid(image_size: tuple[int, int]) -> tuple[Floats, Floats, Floats]:
    """Return the nodes' positions along x and along y, and (3, n) of all nodes: one, x and y."""
    along_x, along_y = (NODE_PX * np.arange(length // NODE_PX + 2, dtype=np.float64) for length in image_size)
    grid = np.ones((3, len(along_y), len(along_x)))
    grid[1], grid[2] = along_x, along_y[:, None]
    return along_x, along_y, grid.reshape(3, -1)


def _even(table: Floats) -> Floats:
    """Return the best affine motion (2, 3), by one, x and y, for a table (5, n) of one, position and motion."""
    sums, by_x, by_y, *_ = (table @ table.T).tolist()
    x, y, *mean = (part / sums[0] for part in sums[1:])
    xx, xy, *along_x = (part - x * whole for part, whole in zip(by_x[1:], sums[1:], strict=True))
    _, yy, *along_y = (part - y * whole for part, whole in zip(by_y[1:], sums[1:], strict=True))
    # Markers in one line do not determine the motion across it.
    xx, yy = xx + 1.0, yy + 1.0
    both = xx * yy - xy * xy
    even = np.empty((2, 3))
    for k in range(2):
        slope_x, slope_y = (yy * along_x[k] - xy * along_y[k]) / both, (xx * along_y[k] - xy * along_x[k]) / both
        even[k] = mean[k] - slope_x * x - slope_y * y, slope_x, slope_y
    return even


def fastest(moved: Floats) -> float:
    """Return the minimum motion of the fastest tenth of the markers, in the unit of their motions (n, 2)."""
    squared = moved[:, 0] ** 2
    squared += moved[:, 1] ** 2
    squared.sort()
    return math.sqrt(squared[int(FASTEST * (len(squared) - 1))])
