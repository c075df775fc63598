"""Residue of the markers in a relief: it is alike around each marker, moves with it, and is subtracted.

A lens that refracts blue more than red separates a marker's colours, which looks like a slope around it. The part that
neighbouring markers share in the reference comes from the lens. A part that only one marker has may be an object, and
stays.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.tactile.imprint.carrying import LEAST_DOTS, CarriedGel
from lsds.tactile.views import smaller

if TYPE_CHECKING:
    from lsds.contracts import DeformationField, MarkerReference
    from lsds.tactile.imprint.relief import Plane, Relief

#: Maximum distance of markers whose residue is compared, in cells along rows and columns.
NEIGHBOURS = 2
#: Minimum RMS curvature of a residue that is subtracted: a weaker one is noise.
WORTH = 0.004


class DotResidue:
    """The residue of one reference's markers."""

    def __init__(self, reference: MarkerReference, relief: Relief, metres_per_px: float) -> None:
        self._metres_per_px = metres_per_px
        self._scale = relief.scale
        self._pitch_px = float(np.mean(reference.pitch_px))
        self._image_size = reference.image_size
        shown = _common(reference, relief)
        strength = float(np.sqrt(np.mean(shown[shown != 0] ** 2))) if shown.any() else 0.0
        self._shown = shown if strength > WORTH else None
        rows, columns = relief.curvature.shape
        self._y, self._x = (part.astype(np.float32) for part in np.mgrid[:rows, :columns])

    def taken_off(self, relief: Relief, field: DeformationField) -> Relief:
        """Return the relief of a frame without the residue of its markers."""
        seen = field.valid
        if self._shown is None or np.count_nonzero(seen) < LEAST_DOTS:
            return relief
        moved = field.displacement_m[seen] / self._metres_per_px
        back = CarriedGel(field.reference.xy_px[seen] + moved, -moved, self._pitch_px, self._image_size)
        motion = back.everywhere(relief.curvature.shape, self._scale)
        carried = cv2.remap(self._shown, self._x + motion[..., 0], self._y + motion[..., 1], cv2.INTER_LINEAR)
        return relief._replace(curvature=np.asarray(relief.curvature - carried, np.float32))


def _common(reference: MarkerReference, relief: Relief) -> Plane:
    """Return the residue (h, w) that each marker shares with its neighbours, at its place in the reference."""
    rows, columns = relief.curvature.shape
    half = int(np.mean(reference.pitch_px) / 2 / relief.scale)
    size = 2 * half + 1
    place = smaller(reference.xy_px, relief.scale)
    inside = (place > half).all(axis=1) & (place[:, 0] < columns - 1 - half) & (place[:, 1] < rows - 1 - half)
    patches = np.array([cv2.getRectSubPix(relief.curvature, (size, size), (float(x), float(y))) for x, y in place])
    shown = np.zeros((rows, columns), np.float32)
    for dot, (x, y) in enumerate(place):
        near = inside & (np.abs(reference.cell - reference.cell[dot]).max(axis=1) <= NEIGHBOURS)
        if np.count_nonzero(near) < 3:
            continue
        common = np.median(patches[near], axis=0)
        shift = np.array([[1.0, 0.0, x - half], [0.0, 1.0, y - half]])
        shown += cv2.warpAffine(common, shift, (columns, rows))
    return shown
