"""Depth of the gel surface from its colours (photometric stereo), and the area in contact.

Colour change against the reference is taken as linear in the surface's slope (Johnson and Adelson 2009, in its
linear form), in proportion to the light that a pixel gets. Its least-squares inverse gives two slopes a pixel, and the
depth map whose differences fit them best comes from one cosine transform (Frankot and Chellappa 1988, with free
borders). All of it runs at a fraction of the image's resolution: contact area needs no fine detail, and the dots'
pixels are averaged out on the way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.contracts import ContactPatch
from lsds.errors import DataError
from lsds.tactile.views import HALF, viewed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Frame


@dataclass(frozen=True, slots=True)
class PhotometricCalibration:
    """Grey levels of R, G, B per unit slope of the depth along x (right) and y (down), the mean over the image, and the
    noise of each.

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

    Minimises sum (z[i, j+1] - z[i, j] - gx)^2 + the same along y, with gx and gy half-way between the points. The
    normal equations are diagonal under the cosine transform (DCT-II), which at these sizes is two small matrix
    products; everything linear before it is folded into them. The mean of z is free and set to zero.
    """

    def __init__(self, height: int, width: int) -> None:
        rows, columns = _cosine_basis(height), _cosine_basis(width)
        eigen = (2 - 2 * np.cos(np.pi * np.arange(height) / height))[:, None] + (
            2 - 2 * np.cos(np.pi * np.arange(width) / width)
        )[None, :]
        eigen[0, 0] = 1.0
        inverse = 1 / eigen
        inverse[0, 0] = 0.0
        self._inverse = inverse.astype(np.float32)
        self._rows, self._columns = _single(rows), _single(columns)
        self._rows_t, self._columns_t = _single(rows.T), _single(columns.T)
        self._rows_source = _single(rows @ _source(height))
        self._columns_source_t = _single((columns @ _source(width)).T)

    def solve(self, slope_x: NDArray[np.float32], slope_y: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return z (h, w) in units of the grid spacing, from mean slopes (h, w) along x and y."""
        spectrum = self._rows @ slope_x @ self._columns_source_t
        spectrum += self._rows_source @ slope_y @ self._columns_t
        spectrum *= self._inverse
        return np.asarray(self._rows_t @ spectrum @ self._columns, np.float32)


def _source(count: int) -> NDArray[np.float64]:
    """Matrix (count, count) from mean slopes along a line to the right-hand side of the normal equations.

    Slopes half-way between the points come from the means to fourth order: a plain average of neighbours would blur
    the contact's edge by half a pixel, and with it the contact area. Weights (-1, 7, 7, -1) / 12 as in finite-volume
    reconstruction (Colella and Woodward 1984); a plain average at the border.
    """
    between = np.zeros((count - 1, count))
    for i in range(count - 1):
        if 0 < i < count - 2:
            between[i, i - 1 : i + 3] = np.array([-1, 7, 7, -1]) / 12
        else:
            between[i, i : i + 2] = 0.5
    difference = np.diff(np.eye(count), axis=0)
    return np.asarray(difference.T @ between)


def _single(matrix: NDArray[np.float64]) -> NDArray[np.float32]:
    return np.ascontiguousarray(matrix, np.float32)


def _cosine_basis(count: int) -> NDArray[np.float64]:
    """Orthonormal DCT-II matrix (count, count)."""
    k, n = np.mgrid[0:count, 0:count]
    basis = np.sqrt(2 / count) * np.cos(np.pi * (n + 0.5) * k / count)
    basis[0] /= np.sqrt(2)
    return np.asarray(basis, np.float64)


class DepthEstimator:
    """Contact patches against one reference frame. `scale` is how many image pixels make a depth pixel."""

    #: Share of the depth map taken to be free of contact when its zero is set.
    FREE_SHARE = 0.25
    #: Quantile of the pixels free of contact that the flat gel is taken to lie at.
    FREE_LEVEL = 0.65

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
        if min(height, width) < 4 * scale:
            raise DataError(
                f"reference frame {reference.seq}: {width} x {height} pixels are too few for depth at 1/{scale} of the "
                "image (lower tactile.depth_scale, or use larger images)"
            )
        self._halvings = (scale // HALF).bit_length() - 1
        # At a sixteenth no pixel is covered by one dot; finer levels fill their holes from there.
        self._coarser = max(1, 5 - scale.bit_length())
        # A size that does not divide is halved to the larger blocks: each step's factor follows from the sizes.
        self._shape = (height // scale, width // scale)
        self._pitch_m = metres_per_px * height / self._shape[0]
        self._fine = (width // HALF, height // HALF)
        self._threshold_m = threshold_m
        self._solver = PoissonSolver(*self._shape)
        self._free = int(self.FREE_SHARE * self._shape[0] * self._shape[1])
        colours = self._colours(reference)
        self._inverse = _pixel_inverse(calibration or PhotometricCalibration(), colours)
        self._reference = colours.reshape(-1, 3).copy()
        self._sampled = np.maximum(colours[_SAMPLE, _SAMPLE].reshape(-1, 3), np.float32(1.0))

    def measure(self, frame: Frame) -> ContactPatch:
        """Return depth (metres, positive where pressed in) and the fraction of the image beyond the threshold."""
        colours = self._colours(frame)
        # Brightness swings and the dim start-up are common to the whole image: the median ratio is their gain.
        ratio = colours[_SAMPLE, _SAMPLE].reshape(-1, 3) / self._sampled
        middle = len(ratio) // 2
        ratio.partition(middle, axis=0)
        gain = np.maximum(ratio[middle], np.float32(0.05))
        change = colours.reshape(-1, 3) / gain
        change -= self._reference
        # Colour by colour over all pixels: three long sums cost a third of as many short ones as there are pixels.
        share = self._inverse * change.T
        slope_x, slope_y = share[:, 0] + share[:, 1] + share[:, 2]
        # A gain off by a thousandth tilts the whole map. As with gains, the middle one of all slopes is a free pixel's.
        slope_x -= _middle(slope_x)
        slope_y -= _middle(slope_y)
        depth = self._solver.solve(slope_x.reshape(self._shape), slope_y.reshape(self._shape))
        depth *= np.float32(self._pitch_m)
        ranked = depth.ravel().copy()
        ranked.partition(self._free)
        depth -= ranked[self._free]
        # The gel bulges beside a contact, deepest where a plain low quantile looks: most of the free surface is higher.
        free = depth[depth < self._threshold_m]
        if free.size:
            level = int(self.FREE_LEVEL * free.size)
            free.partition(level)
            depth -= free[level]
        # The contact's edge runs between depth pixels: count on a finer grid, or whole columns come and go.
        fine = cv2.resize(depth, self._fine, interpolation=cv2.INTER_LINEAR)
        area = np.count_nonzero(fine > self._threshold_m) / fine.size
        return ContactPatch(depth, self._threshold_m, area)

    def _colours(self, frame: Frame) -> NDArray[np.float32]:
        """Mean colour (h, w, 3) of the pixels between the dots, at the depth map's resolution."""
        views = viewed(frame)
        # A dot's soft edge is darker than the gel and not yet dark: keep a pixel's distance.
        free = np.asarray(cv2.bitwise_not(cv2.dilate(views.dark, _AROUND)), np.uint8)
        colour = np.asarray(cv2.copyTo(views.half_rgb, free), np.uint8)
        for _ in range(self._halvings):
            colour, free = _halve(colour), _halve(free)
        return _fill(colour, free, self._coarser)


LEAST_LIGHT = 0.25
"""Of the mean: darker pixels are taken to be this bright, and so to show no slope rather than any."""


def _pixel_inverse(calibration: PhotometricCalibration, reference: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (2, 3, pixels): the calibration's inverse at each pixel of a reference (h, w, 3).

    A surface answers to slopes in proportion to the light it gets (Lambert), and the reference shows how much that is.
    """
    light = reference.reshape(-1, 3)
    # What is nearly dark says nothing of slopes, and must not be made to.
    relative = np.maximum(light / np.maximum(light.mean(axis=0), 1.0), LEAST_LIGHT)
    model = np.asarray(calibration.levels_per_slope, float) * relative[:, :, None]
    weighted = model.transpose(0, 2, 1) / np.square(calibration.noise)
    return np.ascontiguousarray(np.linalg.solve(weighted @ model, weighted).transpose(1, 2, 0), np.float32)


def _middle(values: NDArray[np.float32]) -> np.float32:
    """Return the median of every third value."""
    some = values[::3].copy()
    some.partition(len(some) // 2)
    return np.float32(some[len(some) // 2])


def _halve(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Mean of blocks of two by two pixels, which costs half of what any other factor does."""
    height, width = image.shape[:2]
    size = (max(1, width // 2), max(1, height // 2))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def _fill(total: NDArray[np.uint8], free: NDArray[np.uint8], coarser: int) -> NDArray[np.float32]:
    """Colour (h, w, 3) of the dot-free part of each pixel; where little of it is free, the coarser level's colour.

    `coarser` levels are used (pull-push interpolation, Gortler et al. 1996).
    """
    share = free.astype(np.float32)
    if coarser == 0:
        return np.asarray(total * (np.float32(255) / np.maximum(share, np.float32(1)))[..., None], np.float32)
    around = _fill(_halve(total), _halve(free), coarser - 1)
    around = np.asarray(cv2.resize(around, share.shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)
    around *= np.float32(_WEIGHT / 255)
    around += total
    around *= (np.float32(255) / (share + np.float32(_WEIGHT)))[..., None]
    return around


#: Say of the coarser level in a pixel's colour, as free pixels out of 255.
_WEIGHT = 30
_AROUND = np.ones((3, 3), np.uint8)
#: The gain is the median over every third pixel each way: plenty for one number a channel.
_SAMPLE = slice(1, None, 3)
