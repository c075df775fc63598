"""Markers that have lost ink: too light for the markers' mask, but their rims would look like an object at rest.

The printed grid predicts their positions. Those that the reference shows are excluded from the relief, wherever the
gel carries them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import cv2
import numpy as np

from lsds.tactile.imprint.carrying import LEAST_DOTS, CarriedGel
from lsds.tactile.views import HALF, smaller, surroundings, viewed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import DeformationField, Frame, MarkerReference

    Floats = NDArray[np.float64]

Image = TypeVar("Image", "NDArray[np.uint8]", "NDArray[np.float32]")

#: Minimum contrast of a marker: the share by which its middle is darker than its surroundings.
LEAST_DARKER = 0.03
#: Share of a marker in the markers' mask below which it is faint: noise adds it to the mask and removes it.
COVERED = 0.85
#: Minimum number of markers for the fit of a curved grid; with fewer, an affine one is fitted.
CURVED = 18
#: Share of the grid's markers that the tracker misses above which they are excluded from the relief. Fewer hide no
#: slip, and the shipped learners were trained with them: without them, false alarms tighten 10 % of the grips that
#: hold instead of 2 %.
MANY_MISSED_SHARE = 1 / 8
#: Radius of the search for a faint marker about its grid position, in marker radii.
SEARCH_RADII = 1.0


class FaintDots:
    """The faint markers of one reference. `radius_px` is the radius of a marker."""

    def __init__(self, reference: MarkerReference, image: Frame, metres_per_px: float) -> None:
        self._reference, self._metres_per_px = reference, metres_per_px
        self._pitch_px = float(np.mean(reference.pitch_px))
        views = viewed(image)
        grey, dark = views.half_grey, views.dark
        darker = np.asarray(1 - cv2.divide(grey, surroundings(grey), dtype=cv2.CV_32F), np.float32)
        known = smaller(reference.xy_px, HALF)
        radius = _radius(dark, known, self._pitch_px / HALF)
        self.radius_px = radius * HALF
        missing = smaller(_missing(reference), HALF)
        places = [_settled(darker, place, radius) for place in (*known, *missing)]
        faint = [n for n, place in enumerate(places) if _is_faint(darker, dark, place, radius)]
        #: Positions (n, 2) in the reference, px.
        self.xy_px = smaller(np.array([places[n] for n in faint]).reshape(-1, 2), 1 / HALF)
        #: Mask (n,) of those that the tracker follows, and their indices as markers.
        self._followed = np.array([n < reference.count for n in faint], bool)
        self._marker = np.array([n for n in faint if n < reference.count], int)

    def carried(self, field: DeformationField) -> Floats:
        """Return their positions (n, 2) in a frame, px; those of the reference if too few markers are valid."""
        seen = field.valid
        if not len(self.xy_px) or np.count_nonzero(seen) < LEAST_DOTS:
            return self.xy_px
        moved = field.displacement_m / self._metres_per_px
        tracked = self._followed.copy()
        tracked[tracked] = seen[self._marker]
        places = self.xy_px.copy()
        places[tracked] += moved[self._marker[seen[self._marker]]]
        if not tracked.all():
            reference = self._reference
            gel = CarriedGel(reference.xy_px[seen], moved[seen], self._pitch_px, reference.image_size)
            x, y = self.xy_px[~tracked].T.astype(np.float32)
            places[~tracked] += gel.at(x, y)
        return places


def _radius(dark: NDArray[np.uint8], places: Floats, pitch: float) -> float:
    """Return the radius of a marker with all its ink, px: the upper quartile over all markers."""
    areas = [np.count_nonzero(_patch(dark, place, pitch / 2)) for place in places]
    return float(np.sqrt(np.quantile(areas, 0.75) / np.pi)) if areas else 0.0


def _missing(reference: MarkerReference) -> Floats:
    """Return the positions (n, 2) of grid markers that the reference lacks, px, inside the image; none if few."""
    known = {(int(row), int(column)) for row, column in reference.cell}
    rows, columns = reference.shape
    cells = np.array([(r, c) for r in range(rows) for c in range(columns) if (r, c) not in known], float).reshape(-1, 2)
    if len(cells) <= MANY_MISSED_SHARE * rows * columns or len(known) < LEAST_DOTS:
        return np.zeros((0, 2))
    curved = len(known) >= CURVED
    grid, *_ = np.linalg.lstsq(_terms(reference.cell.astype(float), curved), reference.xy_px, rcond=None)
    places = _terms(cells, curved) @ grid
    inside = (places >= 0).all(axis=1) & (places < reference.image_size).all(axis=1)
    return np.asarray(places[inside], np.float64)


def _terms(cell: Floats, curved: bool) -> Floats:
    row, column = cell.T
    terms = [np.ones_like(row), row, column]
    return np.column_stack([*terms, row * row, row * column, column * column] if curved else terms)


def _settled(darker: NDArray[np.float32], place: Floats, radius: float) -> Floats:
    """Return the centre of the dark region about a place."""
    for _ in range(2):
        near = (1 + SEARCH_RADII) * radius
        patch = np.maximum(_patch(darker, place, near), 0)
        total = float(patch.sum())
        if total <= 0:
            return place
        y, x = np.indices(patch.shape)
        first = np.maximum(np.round(place - near).astype(int), 0)
        place = first + np.array([float((patch * x).sum()), float((patch * y).sum())]) / total
    return place


def _is_faint(darker: NDArray[np.float32], dark: NDArray[np.uint8], place: Floats, radius: float) -> bool:
    """Return whether the image shows a marker there that the markers' mask lacks at least in part."""
    middle = _patch(darker, place, 0.6 * radius)
    if not middle.size or float(middle.mean()) < LEAST_DARKER:
        return False
    return bool(np.count_nonzero(_patch(dark, place, radius)) < COVERED * np.pi * radius**2)


def _patch(image: Image, place: Floats, half: float) -> Image:
    """Return the square of an image, `half` px to each side of a place, cropped at the border."""
    x, y = np.maximum(np.round(place - half).astype(int), 0)
    x_end, y_end = np.maximum(np.round(place + half).astype(int) + 1, 0)
    return image[y:y_end, x:x_end]
