"""Fills holes in a field with the best affine motion plus the mean deviation of the neighbours from it.

The result is exact for affine fields, whichever markers are lost: divergence and curl do not jump when one is lost.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lsds.tactile.motion_fit import AffineMotion, fit_affine

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import DeformationField


class FilledField(NamedTuple):
    """Displacements (N, 2) without holes, in m, and the affine motion of the valid markers, None if degenerate.

    `scatter_m` is the RMS deviation of the valid markers from that motion, along one axis.
    """

    displacement_m: NDArray[np.float64]
    affine: AffineMotion | None
    scatter_m: float


def fill_lost(field: DeformationField) -> FilledField:
    """Return the field with its holes filled."""
    valid = field.valid
    seen, lost = np.flatnonzero(valid), np.flatnonzero(~valid)
    affine = fit_affine(field.position_m[seen], field.displacement_m[seen])
    filled = field.displacement_m.copy()
    if affine is None:
        mean = field.displacement_m[seen].mean(axis=0) if len(seen) else np.zeros(2)
        filled[lost] = mean
        return FilledField(filled, None, float(np.std(field.displacement_m[seen] - mean)) if len(seen) else 0.0)
    offset = field.position_m[lost] - affine.centre
    filled[lost] = affine.translation + offset @ affine.gradient.T
    cell = field.reference.cell
    distance = np.abs(cell[lost][:, None, :] - cell[seen][None, :, :]).sum(axis=-1)
    adjacent = (distance == 1).astype(float)
    neighbours = adjacent.sum(axis=1)
    filled[lost] += (adjacent @ affine.residual) / np.maximum(neighbours, 1)[:, None]
    return FilledField(filled, affine, float(np.sqrt(np.mean(np.square(affine.residual)))))
