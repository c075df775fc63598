"""Marker displacements from the forces and deflections of the bristles.

Forces move the whole surface around them (`lsds_mocks.gel.kernel`); under the contact the surface follows the bristles'
tips. The kernel alone moves markers in the middle of a stuck patch a third farther than the object. Under the contact
the displacement is therefore blended from the kernel's to the tips': fully in the middle of the patch, not at all
outside it.

Both parts are linear in the forces, so one matrix serves one contact; it is rebuilt when the contact changes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.kernel import MarkerKernel

BRISTLE_REACH_M = 0.8e-3
"""Distance over which a bristle tip represents the surface around it."""
QUORUM = 0.1
"""Part of a full patch's weight at which tips and kernel have equal weight."""


def _nearness(xy_m: NDArray[np.float64], points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    square = (xy_m[:, 0, None] - points_m[0]) ** 2 + (xy_m[:, 1, None] - points_m[1]) ** 2
    return np.asarray(np.exp(-square / (2 * BRISTLE_REACH_M**2)))


def _normalised(near: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (M, N): weight of each tip for each marker; rows add up to less than 1, to 0 far from the contact.

    `share` (N,) is 1 in the middle of the contact, 0 at its rim and beyond.
    """
    weights = near * share
    total = weights.sum(axis=1, keepdims=True)
    crowd = float(near.sum(axis=1).max(initial=1e-12))
    return np.asarray(weights / (total + QUORUM * crowd))


class MarkerField:
    """Displacements of M markers on N bristles; single precision is exact to a millionth of a pixel."""

    def __init__(self, xy_m: NDArray[np.float64], points_m: NDArray[np.float64], kernel: MarkerKernel) -> None:
        self.xy_m = xy_m
        self._at_dots = _by_direction(kernel.matrix(xy_m, points_m), points_m.shape[1])
        self._at_tips = _by_direction(kernel.matrix(points_m.T, points_m), points_m.shape[1])
        self._near = _nearness(xy_m, points_m)
        self._share: NDArray[np.float64] | None = None
        self._weights = np.zeros(self._near.shape, np.float32)
        self._of_force = np.zeros_like(self._at_dots)

    def displacement(
        self, force_n: NDArray[np.float64], tips_m: NDArray[np.float64], share: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return (M, 2) metres for point forces (3 N,) fx, fy, p and tip displacements (2, N)."""
        if self._share is None or not np.array_equal(share, self._share):
            self._take_contact(share)
        force = force_n.astype(np.float32).reshape(3, -1, 1)
        by_force = (self._of_force @ force)[..., 0].sum(axis=1)
        by_tips = tips_m.astype(np.float32) @ self._weights.T
        return np.asarray((by_force + by_tips).T, np.float64)

    def _take_contact(self, share: NDArray[np.float64]) -> None:
        """Set the matrices of a contact: the kernel at the markers less its weighted value at the tips."""
        self._share = share
        self._weights = _normalised(self._near, share).astype(np.float32)
        for start in range(0, len(self._weights), _ROWS_PER_PRODUCT):
            rows = slice(start, start + _ROWS_PER_PRODUCT)
            np.subtract(self._at_dots[:, :, rows], self._weights[rows] @ self._at_tips, out=self._of_force[:, :, rows])


_ROWS_PER_PRODUCT = 16
"""Markers per product. BLAS computes products of this size without its threads, which on a busy machine delay a
frame."""


def _by_direction(matrix: NDArray[np.float64], points: int) -> NDArray[np.float32]:
    """Return a kernel matrix (2 M, 3 N) as (2, 3, M, N): displacement x and y, force fx, fy and p."""
    parts = matrix.reshape(2, -1, 3, points).transpose(0, 2, 1, 3)
    return np.ascontiguousarray(parts, np.float32)
