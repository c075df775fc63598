"""Fills holes in a field with the best affine motion plus the mean deviation of the neighbours from it.

The result is exact for affine fields, whichever markers are lost: divergence and curl do not jump when one is lost.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds.tactile.motion_fit import AffineMotion, fit_affine

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import DeformationField


def fill_lost(field: DeformationField) -> tuple[NDArray[np.float64], AffineMotion | None]:
    """Return displacements (N, 2) without holes, and the affine motion of the valid markers (None if degenerate)."""
    valid = field.valid
    seen, lost = np.flatnonzero(valid), np.flatnonzero(~valid)
    affine = fit_affine(field.position_m[seen], field.displacement_m[seen])
    filled = field.displacement_m.copy()
    if affine is None:
        filled[lost] = field.displacement_m[seen].mean(axis=0) if len(seen) else 0.0
        return filled, None
    offset = field.position_m[lost] - affine.centre
    filled[lost] = affine.translation + offset @ affine.gradient.T
    cell = field.reference.cell
    distance = np.abs(cell[lost][:, None, :] - cell[seen][None, :, :]).sum(axis=-1)
    adjacent = (distance == 1).astype(float)
    neighbours = adjacent.sum(axis=1)
    filled[lost] += (adjacent @ affine.residual) / np.maximum(neighbours, 1)[:, None]
    return filled, affine
