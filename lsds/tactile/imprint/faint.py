"""Dots that have lost ink: too light to be masked as dots, but their rims would be taken for an object at rest.

The grid tells where they are. One that the reference shows is left out of the relief, wherever the gel carries it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.tactile.imprint.carrying import LEAST_DOTS, CarriedGel
from lsds.tactile.views import HALF, smaller, surroundings, viewed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import DeformationField, Frame, MarkerReference

    Floats = NDArray[np.float64]

#: A dot's middle is darker than its surroundings by this share at least, or there is none.
LEAST_DARKER = 0.03
#: Less of a dot than this in the dots' mask, and it is faint: noise takes it in and out of the mask.
COVERED = 0.85
#: Dots that a curved grid is fitted to; to fewer, an even one.
CURVED = 18
#: Where the tracker misses more than this share of the grid's dots, those are left out. Fewer hide no slip, and the
#: shipped learners know reliefs with them: left out, 10 % of the grips that hold grow by false alarms instead of 2 %.
MANY = 1 / 8
#: A faint dot is looked for this far from where the grid has it, in radii.
NEAR = 1.0


class FaintDots:
    """The faint dots of one reference. `radius_px` is that of a dot."""

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
        #: Which of them the tracker follows, and as which marker.
        self._followed = np.array([n < reference.count for n in faint], bool)
        self._marker = np.array([n for n in faint if n < reference.count], int)

    def carried(self, field: DeformationField) -> Floats:
        """Return where they are in a frame (n, 2), px; as in the reference where too few dots tell the gel's motion."""
        seen = field.valid
        if not len(self.xy_px) or np.count_nonzero(seen) < LEAST_DOTS:
            return self.xy_px
        moved = field.displacement_m / self._metres_per_px
        told = self._followed.copy()
        told[told] = seen[self._marker]
        places = self.xy_px.copy()
        places[told] += moved[self._marker[seen[self._marker]]]
        if not told.all():
            reference = self._reference
            gel = CarriedGel(reference.xy_px[seen], moved[seen], self._pitch_px, reference.image_size)
            x, y = self.xy_px[~told].T.astype(np.float32)
            places[~told] += gel.at(x, y)
        return places


def _radius(dark: NDArray[np.uint8], places: Floats, pitch: float) -> float:
    """Return the radius of a dot with all its ink, px: that of the upper quarter of those found."""
    areas = [np.count_nonzero(_patch(dark, place, pitch / 2)) for place in places]
    return float(np.sqrt(np.quantile(areas, 0.75) / np.pi)) if areas else 0.0


def _missing(reference: MarkerReference) -> Floats:
    """Return where the grid has dots (n, 2) that the reference has not, px, inside the image; none of only a few."""
    known = {(int(row), int(column)) for row, column in reference.cell}
    rows, columns = reference.shape
    cells = np.array([(r, c) for r in range(rows) for c in range(columns) if (r, c) not in known], float).reshape(-1, 2)
    if len(cells) <= MANY * rows * columns or len(known) < LEAST_DOTS:
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
    """Return the middle of what is dark about a place."""
    for _ in range(2):
        near = (1 + NEAR) * radius
        patch = np.maximum(_patch(darker, place, near), 0)
        total = float(patch.sum())
        if total <= 0:
            return place
        y, x = np.indices(patch.shape)
        first = np.maximum(np.round(place - near).astype(int), 0)
        place = first + np.array([float((patch * x).sum()), float((patch * y).sum())]) / total
    return place


def _is_faint(darker: NDArray[np.float32], dark: NDArray[np.uint8], place: Floats, radius: float) -> bool:
    """Tell whether the image shows a dot there that the dots' mask does not, or only in part."""
    middle = _patch(darker, place, 0.6 * radius)
    if not middle.size or float(middle.mean()) < LEAST_DARKER:
        return False
    return bool(np.count_nonzero(_patch(dark, place, radius)) < COVERED * np.pi * radius**2)


def _patch(image: NDArray[np.uint8] | NDArray[np.float32], place: Floats, half: float) -> NDArray[np.float32]:
    """Return the square of an image, `half` px to each side of a place; less of it at the border."""
    x, y = np.maximum(np.round(place - half).astype(int), 0)
    x_end, y_end = np.maximum(np.round(place + half).astype(int) + 1, 0)
    return np.asarray(image[y:y_end, x:x_end])
