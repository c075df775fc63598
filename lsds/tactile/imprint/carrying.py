"""How the gel's surface moves between two frames, everywhere, from the dots that both show."""

from __future__ import annotations

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
        width, height = image_size
        node_x = np.arange(width // NODE_PX + 2) * float(NODE_PX)
        node_y = np.arange(height // NODE_PX + 2) * float(NODE_PX)
        count = len(position)
        centre, mean = position.sum(axis=0) / count, moved.sum(axis=0) / count
        offset = position - centre
        (xx, xy), (_, yy) = (offset.T @ offset).tolist()
        # Dots in one line tell nothing across it.
        xx, yy = xx + 1.0, yy + 1.0
        slopes = np.array([[yy, -xy], [-xy, xx]]) @ (offset.T @ moved) / (xx * yy - xy * xy)
        narrow = -0.5 / (REACH * pitch_px) ** 2
        # A Gaussian of a distance is the product of those along x and y.
        near_x = np.exp(narrow * (node_x[:, None] - position[:, 0]) ** 2)
        near_y = np.exp(narrow * (node_y[:, None] - position[:, 1]) ** 2)
        rest = np.ones((3, 1, count))
        rest[:2, 0] = (moved - mean - offset @ slopes).T
        *deviation, say = (near_y * rest) @ near_x.T
        say += _EVEN
        across, down = node_x - centre[0], (node_y - centre[1])[:, None]
        nodes = np.empty((len(node_y), len(node_x), 2), np.float32)
        for k, own in enumerate(deviation):
            nodes[..., k] = own / say + (mean[k] + across * slopes[0, k] + down * slopes[1, k])
        self._nodes = nodes
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

    def at(self, x: Plane, y: Plane) -> Plane:
        """Return the motion (n, 2) at positions (n,), all in px of the image."""
        scale = np.float32(1 / NODE_PX)
        found = cv2.remap(self._nodes, x * scale, y * scale, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(found, np.float32).reshape(-1, 2)


def fastest(moved: Floats) -> float:
    """Return how far the fastest tenth of the dots has moved at least, in the unit of their motions (n, 2)."""
    length = np.hypot(moved[:, 0], moved[:, 1])
    rank = int(FASTEST * (len(length) - 1))
    return float(np.partition(length, rank)[rank])
