"""Divergence and curl on the printed grid, as one matrix that is applied to every frame.

The paper's Eq. 4 sums central differences with a flat index i +- 1, which cannot be the neighbour in x and in y at
once. Here each marker uses its left, right, upper and lower neighbours; at the border the marker itself replaces the
missing one (one-sided). The difference quotient uses the measured vectors between the neighbours, so any affine field
gives its exact value on a rotated, distorted or unevenly printed grid.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import MarkerReference


def gradient_operators(
    reference: MarkerReference, position_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (divergence, curl), each (N, 2 N): per marker, from displacements flattened as (x0, y0, x1, y1, ...).

    A marker without any neighbour along one of the axes has rows of zeros.
    """
    count = reference.count
    node = {(int(r), int(c)): i for i, (r, c) in enumerate(reference.cell)}
    divergence, curl = np.zeros((count, 2 * count)), np.zeros((count, 2 * count))
    for (row, column), i in node.items():
        right, left = node.get((row, column + 1), i), node.get((row, column - 1), i)
        below, above = node.get((row + 1, column), i), node.get((row - 1, column), i)
        basis = np.stack([position_m[right] - position_m[left], position_m[below] - position_m[above]], axis=1)
        if right == left or below == above:
            continue
        # G = [d_right - d_left, d_below - d_above] basis^-1, so tr G and G_yx - G_xy are linear in d.
        (p, q), (r, s) = np.linalg.inv(basis).tolist()
        for j, sign in ((right, 1.0), (left, -1.0)):
            divergence[i, 2 * j] += sign * p
            divergence[i, 2 * j + 1] += sign * q
            curl[i, 2 * j + 1] += sign * p
            curl[i, 2 * j] -= sign * q
        for j, sign in ((below, 1.0), (above, -1.0)):
            divergence[i, 2 * j] += sign * r
            divergence[i, 2 * j + 1] += sign * s
            curl[i, 2 * j + 1] += sign * r
            curl[i, 2 * j] -= sign * s
    return divergence, curl
