"""Colour from the slopes of the surface, computed at a reduced resolution because the surface is smooth.

`linear`: brightness is linear in the slope, with the sensitivity of each pixel's lamps. `full`: Lambert's cosine law
for the surface's normal, without light from lamps that a slope faces away from; it differs from `linear` above slopes
of about 0.4. `markers`: slopes have no effect. Cast shadows are not rendered; they are below a third of a level up to
slopes of 0.56.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import cv2
import numpy as np
from numba import njit

from lsds_mocks.optics.background import AMBIENT
from lsds_mocks.optics.lamps import lamps
from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from lsds_mocks.optics.grain import Grain, Pose

    Placed = tuple[Grain, Pose]

Tier = Literal["markers", "linear", "full"]
REDUCTION = 4
"""Pixels between samples of the surface along either axis."""
FINE_REDUCTION = 2
"""The same for the fine relief of the object's surface."""
LIFT_M = 0.1e-3
"""Depth at which pressed gel reaches its full extra brightness."""


class Shader:
    """Renders background plus slope colour; caches the last image, because the surface of a gel at rest is constant."""

    def __init__(
        self,
        background: NDArray[np.float32],
        metres_per_px: float,
        tier: Tier = "linear",
        *,
        lift_levels: float = 0.0,
        reduction: int = REDUCTION,
        mirror: float = 1.0,
    ) -> None:
        self._background = background
        self._plain = np.clip(np.rint(background), 0, 255).astype(np.uint8)
        self._tier = tier
        self._lift = lift_levels
        self._spacing = reduction * metres_per_px
        size = (WIDTH_PX // reduction, HEIGHT_PX // reduction)
        self.x_m = _axis(WIDTH_PX, reduction, metres_per_px)
        self.y_m = _axis(HEIGHT_PX, reduction, metres_per_px)
        directed = np.maximum(background - np.float32(AMBIENT), 0)
        self._directed = np.asarray(cv2.resize(directed, size, interpolation=cv2.INTER_AREA), np.float32)
        self._lamps = lamps(self._directed)
        self._change = np.zeros_like(self._directed)
        self._float = np.empty_like(background)
        self.fine_x_m = _axis(WIDTH_PX, FINE_REDUCTION, metres_per_px)
        self.fine_y_m = _axis(HEIGHT_PX, FINE_REDUCTION, metres_per_px)
        fine = (len(self.fine_x_m), len(self.fine_y_m))
        enlarged = (cv2.resize(plane, fine, interpolation=cv2.INTER_LINEAR) for plane in (self._lamps.x, self._lamps.y))
        light = cv2.resize(directed, fine, interpolation=cv2.INTER_AREA)
        #: Levels (h, w, 3) per unit slope along x and y.
        lean_x, lean_y = (np.asarray(light * lean, np.float32) for lean in enlarged)
        self._per_slope, self._mirror = (lean_x, lean_y), mirror
        self._fine, self._enlarged = np.empty_like(lean_x), np.empty_like(lean_x)
        self._key: object = None
        self._image = self._plain

    def shade(
        self,
        key: object,
        depth: Callable[..., NDArray[np.float32]],
        touching: bool,
        grain: Placed | None = None,
    ) -> NDArray[np.uint8]:
        """Return the lit gel (240, 320, 3); equal keys mean the same surface, None always means a new one.

        `grain` is the object's fine relief with the object's pose.
        """
        if not touching or self._tier == "markers":
            return self._plain
        if key is None or key != self._key:
            self._key = key
            self._image = self.lit(depth(self.x_m, self.y_m), grain)
        return self._image

    def lit(self, depth: NDArray[np.float32], grain: Placed | None = None) -> NDArray[np.uint8]:
        """Return the image (240, 320, 3) of a surface (h, w) in metres below the flat gel."""
        full = self._tier == "full"
        lean = self._lamps
        colour(self._change, depth, self._directed, lean.x, lean.y, 0.5 / self._spacing, full, self._lift)
        change = self._change
        if grain is not None:
            relief, pose = grain
            fine, places = self._fine, (self.fine_x_m, self.fine_y_m)
            if relief.paint(fine, pose, depth, *places, self._per_slope, self._mirror):
                size = (fine.shape[1], fine.shape[0])
                cv2.resize(change, size, dst=self._enlarged, interpolation=cv2.INTER_LINEAR)
                change = np.asarray(cv2.add(self._enlarged, fine, dst=fine), np.float32)
        cv2.resize(change, (WIDTH_PX, HEIGHT_PX), dst=self._float, interpolation=cv2.INTER_LINEAR)
        return np.asarray(cv2.add(self._float, self._background, dtype=cv2.CV_8U), np.uint8)


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def colour(
    change: NDArray[np.float32],
    depth: NDArray[np.float32],
    directed: NDArray[np.float32],
    lean_x: NDArray[np.float32],
    lean_y: NDArray[np.float32],
    scale: float,
    full: bool,
    lift: float,
) -> None:
    """Write the change of levels (h, w, 3) due to the slopes of `depth` (h, w); slopes at the borders are zero."""
    rows, columns = depth.shape
    for r in range(rows):
        above, below = max(r - 1, 0), min(r + 1, rows - 1)
        for c in range(columns):
            gx = scale * (depth[r, min(c + 1, columns - 1)] - depth[r, max(c - 1, 0)])
            gy = scale * (depth[below, c] - depth[above, c])
            brighter = lift * min(max(depth[r, c] / LIFT_M, 0.0), 1.0)
            norm = 1.0 / math.sqrt(1.0 + gx * gx + gy * gy) if full else 1.0
            for k in range(3):
                share = 1.0 + gx * lean_x[r, c, k] + gy * lean_y[r, c, k]
                if full:
                    share = max(share, 0.0) * norm
                change[r, c, k] = directed[r, c, k] * (share - 1.0) + brighter


def _axis(size: int, reduction: int, metres_per_px: float) -> NDArray[np.float64]:
    """Positions (m) of the reduced pixels' centres from the image's centre."""
    pixels = (np.arange(size // reduction) + 0.5) * reduction - 0.5
    return np.asarray((pixels - (size - 1) / 2) * metres_per_px, np.float64)
