"""Depth of the gel surface from its colours (photometric stereo), and the area in contact.

The model takes the colour change against the reference as linear in the surface's slope (Johnson and Adelson 2009, in
its linear form) and proportional to the light on a pixel. Its least-squares inverse gives two slopes per pixel. One
cosine transform yields the depth map whose differences fit them best (Frankot and Chellappa 1988, with free borders).
The computation runs at a fraction of the image's resolution: contact area needs no fine detail, and averaging removes
the markers' pixels.
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
    """Grey levels of R, G, B per unit slope of the depth along x (right) and y (down), and their noise.

    Both are means over the image. The defaults were measured on a public GelSight Mini calibration set. Depth is
    positive into the gel.
    """

    levels_per_slope: tuple[tuple[float, float], ...] = ((-14.0, -88.0), (84.0, 9.0), (11.0, 62.0))
    noise: tuple[float, float, float] = (2.0, 1.1, 2.0)

    def inverse(self) -> NDArray[np.float32]:
        """Return the (3, 2) weighted least-squares matrix from colour changes (…, 3) to slopes (…, 2)."""
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
    """Return the matrix (count, count) from mean slopes along a line to the right-hand side of the normal equations.

    Slopes half-way between the points are interpolated to fourth order, with the weights (-1, 7, 7, -1) / 12 of
    finite-volume reconstruction (Colella and Woodward 1984). A plain average would blur the contact's edge, and so its
    area, by half a pixel; it is used at the border only.
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

    #: Share of the depth map that is assumed free of contact when its zero is set.
    FREE_SHARE = 0.25
    #: Quantile of the contact-free pixels that is the level of the flat gel.
    FREE_LEVEL = 0.65

    def __init__(
        self,
        reference: Frame,
        metres_per_px: float,
        *,
        scale: int = 8,
        threshold_m: float = 50e-6,
        calibration: PhotometricCalibration | None = None,
        compiled: bool = False,
    ) -> None:
        """`compiled` is whether compiled functions compute it; those need an image that halves evenly."""
        height, width = reference.image.shape[:2]
        if scale < HALF or scale & (scale - 1):
            raise ValueError(f"scale must be a power of two, {HALF} or more, got {scale}")
        if min(height, width) < 4 * scale:
            raise DataError(
                f"reference frame {reference.seq}: {width} x {height} pixels are too few for depth at 1/{scale} of the "
                "image (lower tactile.depth_scale, or use larger images)"
            )
        self._halvings = (scale // HALF).bit_length() - 1
        # At 1/16 no marker covers a whole pixel; finer levels fill their holes from there.
        self._coarser = max(1, 5 - scale.bit_length())
        # An odd size is halved to larger blocks, so the scale of each step follows from the sizes.
        self._shape = (height // scale, width // scale)
        self._pitch_m = metres_per_px * height / self._shape[0]
        self._fine = (width // HALF, height // HALF)
        self._threshold_m = threshold_m
        self._solver = PoissonSolver(*self._shape)
        self._free = int(self.FREE_SHARE * self._shape[0] * self._shape[1])
        self._compiled = compiled and height % (scale << self._coarser) == width % (scale << self._coarser) == 0
        self._block = 1 << self._halvings
        colours = np.moveaxis(self._planes(reference), 0, 2) if self._compiled else self._colours(reference)
        self._inverse = _pixel_inverse(calibration or PhotometricCalibration(), colours)
        self._reference = colours.reshape(-1, 3).copy()
        self._sampled = np.maximum(colours[_SAMPLE, _SAMPLE].reshape(-1, 3), np.float32(1.0))
        #: The same as planes: reference, every `_EVERY`-th pixel of it, and inverse.
        self._as_planes = (
            np.ascontiguousarray(self._reference.T).reshape(3, *self._shape),
            np.ascontiguousarray(self._sampled.T),
            self._inverse.reshape(2, 3, *self._shape),
        )

    def measure(self, frame: Frame) -> ContactPatch:
        """Return depth (metres, positive where pressed in) and the fraction of the image beyond the threshold."""
        if self._compiled:
            return self._measure_compiled(frame)
        colours = self._colours(frame)
        # Brightness changes and the dim start-up affect the whole image alike: the median ratio is their gain.
        ratio = colours[_SAMPLE, _SAMPLE].reshape(-1, 3) / self._sampled
        middle = len(ratio) // 2
        ratio.partition(middle, axis=0)
        gain = np.maximum(ratio[middle], np.float32(_LEAST_GAIN))
        change = colours.reshape(-1, 3) / gain
        change -= self._reference
        # Three long sums over all pixels cost a third of one short sum per pixel.
        share = self._inverse * change.T
        slope_x, slope_y = share[:, 0] + share[:, 1] + share[:, 2]
        # A gain error of 0.1 % tilts the whole map. The median slope, like the median gain, is that of a free pixel.
        slope_x -= _middle(slope_x)
        slope_y -= _middle(slope_y)
        depth = self._solver.solve(slope_x.reshape(self._shape), slope_y.reshape(self._shape))
        depth *= np.float32(self._pitch_m)
        ranked = depth.ravel().copy()
        ranked.partition(self._free)
        depth -= ranked[self._free]
        # The gel bulges around a contact, and a low quantile would pick the bulge: most of the free surface is higher.
        free = depth[depth < self._threshold_m]
        if free.size:
            level = int(self.FREE_LEVEL * free.size)
            free.partition(level)
            depth -= free[level]
        # The contact's edge runs between depth pixels: a coarse count would jump by whole columns.
        fine = cv2.resize(depth, self._fine, interpolation=cv2.INTER_LINEAR)
        area = np.count_nonzero(fine > self._threshold_m) / fine.size
        return ContactPatch(depth, self._threshold_m, area, self._pitch_m)

    def _measure_compiled(self, frame: Frame) -> ContactPatch:
        from lsds.tactile.compiled.depth import level_depth, slopes_of

        colours = self._planes(frame)
        slopes = slopes_of(colours, *self._as_planes, _EVERY, np.float32(_LEAST_GAIN))
        depth = self._solver.solve(slopes[0], slopes[1])
        depth *= np.float32(self._pitch_m)
        threshold = np.float32(self._threshold_m)
        area = level_depth(depth, self._free, threshold, self.FREE_LEVEL, self._block)
        return ContactPatch(depth, self._threshold_m, area, self._pitch_m)

    def _planes(self, frame: Frame) -> NDArray[np.float32]:
        """Return `_colours` as planes (3, h, w)."""
        from lsds.tactile.compiled.depth import colours_of

        views = viewed(frame)
        free = np.asarray(cv2.bitwise_not(cv2.dilate(views.dark, _AROUND)), np.uint8)
        planes: NDArray[np.float32] = colours_of(
            *views.half_planes, free, self._halvings, self._coarser, np.float32(_WEIGHT)
        )
        return planes

    def _colours(self, frame: Frame) -> NDArray[np.float32]:
        """Return the mean colour (h, w, 3) of the pixels between the markers, at the depth map's resolution."""
        views = viewed(frame)
        # A marker's soft edge is darker than the gel but not in the mask: keep a pixel's distance.
        free = np.asarray(cv2.bitwise_not(cv2.dilate(views.dark, _AROUND)), np.uint8)
        colour = np.asarray(cv2.copyTo(views.half_rgb, free), np.uint8)
        for _ in range(self._halvings):
            colour, free = _halve(colour), _halve(free)
        return _fill(colour, free, self._coarser)


LEAST_LIGHT_SHARE = 0.25
"""Minimum light of a pixel as a share of the mean. Darker pixels get this value, so that they show no false slope."""


def _pixel_inverse(calibration: PhotometricCalibration, reference: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the calibration's inverse at each pixel of a reference (h, w, 3), as (2, 3, pixels).

    A pixel's response to a slope is proportional to the light on it (Lambert), which the reference measures.
    """
    light = reference.reshape(-1, 3)
    relative = np.maximum(light / np.maximum(light.mean(axis=0), 1.0), LEAST_LIGHT_SHARE)
    model = np.asarray(calibration.levels_per_slope, float) * relative[:, :, None]
    weighted = model.transpose(0, 2, 1) / np.square(calibration.noise)
    return np.ascontiguousarray(np.linalg.solve(weighted @ model, weighted).transpose(1, 2, 0), np.float32)


def _middle(values: NDArray[np.float32]) -> np.float32:
    """Return the median of every third value."""
    some = values[::3].copy()
    some.partition(len(some) // 2)
    return np.float32(some[len(some) // 2])


def _halve(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the means of 2 x 2 blocks; any other factor takes twice the time."""
    height, width = image.shape[:2]
    size = (max(1, width // 2), max(1, height // 2))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def _fill(total: NDArray[np.uint8], free: NDArray[np.uint8], coarser: int) -> NDArray[np.float32]:
    """Return the colour (h, w, 3) of the marker-free part of each pixel.

    Pixels with a small free part take the colour of the coarser level, up to `coarser` levels (pull-push interpolation,
    Gortler et al. 1996).
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


#: Weight of the coarser level in a pixel's colour; a pixel that is free of markers weighs 255.
_WEIGHT = 30
_AROUND = np.ones((3, 3), np.uint8)
#: Pixels per axis that the gain is taken from: every third one suffices for one number per channel.
_EVERY = 3
_SAMPLE = slice(1, None, _EVERY)
#: Minimum gain of the light against the reference; chosen.
_LEAST_GAIN = 0.05
