"""Depth of the gel surface from its colours (photometric stereo), and the area in contact.

Colour change against the reference is taken as linear in the surface's slope (Johnson and Adelson 2009, in its
linear form); its least-squares inverse gives two slopes a pixel, and the depth map whose differences fit them best
comes from one cosine transform (Frankot and Chellappa 1988, with free borders). All of it runs at a fraction of the
image's resolution: contact area needs no fine detail, and the dots' pixels are averaged out on the way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.contracts import ContactPatch
from lsds.tactile.views import HALF, views_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Frame


@dataclass(frozen=True, slots=True)
class PhotometricCalibration:
    """Grey levels of R, G, B per unit slope of the depth along x (right) and y (down), and the noise of each.

    Default: measured on a public GelSight Mini calibration set. Depth is positive into the gel.
    """

    levels_per_slope: tuple[tuple[float, float], ...] = ((-14.0, -88.0), (84.0, 9.0), (11.0, 62.0))
    noise: tuple[float, float, float] = (2.0, 1.1, 2.0)

    def inverse(self) -> NDArray[np.float32]:
        """Return the (3, 2) matrix that takes colour changes (…, 3) to slopes (…, 2): weighted least squares."""
        model = np.asarray(self.levels_per_slope, float)
        weight = np.diag(1 / np.square(self.noise))
        return np.asarray(np.linalg.solve(model.T @ weight @ model, model.T @ weight).T, np.float32)


class PoissonSolver:
    """Depth from slopes on an (h, w) grid of unit spacing, by least squares with free borders.

    Minimises sum (z[i, j+1] - z[i, j] - gx)^2 + the same along y, with slopes averaged onto the half-way points. The
    normal equations are diagonal under the cosine transform (DCT-II), which at these sizes is two small matrix
    products. The mean of z is free and set to zero.
    """

    def __init__(self, height: int, width: int) -> None:
        self._rows, self._columns = _cosine_basis(height), _cosine_basis(width)
        self._rows_t, self._columns_t = (np.ascontiguousarray(basis.T) for basis in (self._rows, self._columns))
        eigen = (2 - 2 * np.cos(np.pi * np.arange(height) / height))[:, None] + (
            2 - 2 * np.cos(np.pi * np.arange(width) / width)
        )[None, :]
        eigen[0, 0] = 1.0
        self._inverse = (1 / eigen).astype(np.float32)
        self._inverse[0, 0] = 0.0
        self._source = np.zeros((height, width), np.float32)

    def solve(self, slope_x: NDArray[np.float32], slope_y: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return z (h, w) in units of the grid spacing, from slopes (h, w) along x and y."""
        half_x = (slope_x[:, 1:] + slope_x[:, :-1]) * np.float32(0.5)
        half_y = (slope_y[1:] + slope_y[:-1]) * np.float32(0.5)
        source = self._source
        source[:] = 0.0
        source[:, 1:] += half_x
        source[:, :-1] -= half_x
        source[1:] += half_y
        source[:-1] -= half_y
        spectrum = (self._rows @ source @ self._columns_t) * self._inverse
        return np.asarray(self._rows_t @ spectrum @ self._columns, np.float32)


def _cosine_basis(count: int) -> NDArray[np.float32]:
    """Orthonormal DCT-II matrix (count, count)."""
    k, n = np.mgrid[0:count, 0:count]
    basis = np.sqrt(2 / count) * np.cos(np.pi * (n + 0.5) * k / count)
    basis[0] /= np.sqrt(2)
    return np.asarray(basis, np.float32)


class DepthEstimator:
    """Contact patches against one reference frame. `scale` is how many image pixels make a depth pixel."""

    #: Share of the depth map taken to be free of contact when its zero is set.
    FREE_SHARE = 0.15

    def __init__(
        self,
        reference: Frame,
        metres_per_px: float,
        *,
        scale: int = 8,
        threshold_m: float = 50e-6,
        calibration: PhotometricCalibration | None = None,
    ) -> None:
        height, width = reference.image.shape[:2]
        if scale < HALF or scale & (scale - 1):
            raise ValueError(f"scale must be a power of two, {HALF} or more, got {scale}")
        self._halvings = (scale // HALF).bit_length() - 1
        # A size that does not divide is halved to the larger blocks: each step's factor follows from the sizes.
        self._shape = (height // scale, width // scale)
        self._pitch_m = metres_per_px * height / self._shape[0]
        self._threshold_m = threshold_m
        self._inverse = (calibration or PhotometricCalibration()).inverse()
        self._solver = PoissonSolver(*self._shape)
        self._free = int(self.FREE_SHARE * self._shape[0] * self._shape[1])
        colours = self._colours(reference)
        self._reference_slope = colours.reshape(-1, 3) @ self._inverse
        self._sampled = np.maximum(colours[_SAMPLE, _SAMPLE].reshape(-1, 3), np.float32(1.0))

    def measure(self, frame: Frame) -> ContactPatch:
        """Return depth (metres, positive where pressed in) and the fraction of the image beyond the threshold."""
        colours = self._colours(frame)
        # Brightness swings and the dim start-up are common to the whole image: the median ratio is their gain.
        ratio = colours[_SAMPLE, _SAMPLE].reshape(-1, 3) / self._sampled
        middle = len(ratio) // 2
        ratio.partition(middle, axis=0)
        gain = np.maximum(ratio[middle], np.float32(0.05))
        # (colours / gain - reference) @ inverse, with the gain folded into the small matrix.
        slope = colours.reshape(-1, 3) @ (self._inverse / gain[:, None]) - self._reference_slope
        depth = self._solver.solve(slope[:, 0].reshape(self._shape), slope[:, 1].reshape(self._shape))
        depth *= np.float32(self._pitch_m)
        ranked = depth.ravel().copy()
        ranked.partition(self._free)
        depth -= ranked[self._free]
        area = float(np.count_nonzero(depth > self._threshold_m)) / depth.size
        return ContactPatch(depth, self._threshold_m, area)

    def _colours(self, frame: Frame) -> NDArray[np.float32]:
        """Mean colour (h, w, 3) of the pixels between the dots, at the depth map's resolution."""
        views = views_of(frame)
        # A dot's soft edge is darker than the gel and not yet dark: keep a pixel's distance.
        free = np.asarray(cv2.bitwise_not(cv2.dilate(views.dark, _AROUND)), np.uint8)
        colour = np.asarray(cv2.copyTo(views.half_rgb, free), np.uint8)
        for _ in range(self._halvings):
            colour, free = _halve(colour), _halve(free)
        mean, share = _mean_colour(colour, free)
        if share.min() < _LEAST_SHARE:
            # Nothing but dot in these: take the mean of the surroundings, from one level coarser.
            coarse, _ = _mean_colour(_halve(colour), _halve(free))
            around = cv2.resize(coarse, self._shape[::-1], interpolation=cv2.INTER_NEAREST)
            np.copyto(mean, around, where=(share < _LEAST_SHARE)[..., None])
        return mean


def _halve(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Mean of blocks of two by two pixels, which costs half of what any other factor does."""
    height, width = image.shape[:2]
    size = (max(1, width // 2), max(1, height // 2))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def _mean_colour(total: NDArray[np.uint8], free: NDArray[np.uint8]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Colour (h, w, 3) of the dot-free part of each pixel, and that part (h, w) in grey levels out of 255."""
    share = free.astype(np.float32)
    mean = total * (np.float32(255) / np.maximum(share, np.float32(1)))[..., None]
    return np.asarray(mean, np.float32), share


#: A depth pixel with less than this much of its image pixels (out of 255) free of dots is filled from around it.
_LEAST_SHARE = 30
_AROUND = np.ones((3, 3), np.uint8)
#: The gain is the median over every third pixel each way: plenty for one number a channel.
_SAMPLE = slice(1, None, 3)
