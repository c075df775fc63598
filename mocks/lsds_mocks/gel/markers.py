"""From what the bristles feel to where the dots go.

Two views of the same surface: forces move everything around them (`lsds_mocks.gel.kernel`), and under the contact the
surface goes where the bristles' tips go. The kernel alone lets dots in the middle of a stuck patch overtake the
object by a third; so under the contact the kernel's answer is drawn to the tips, fully in the middle of the patch
and not at all beside it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.kernel import MarkerKernel

REACH_M = 0.8e-3
"""Over what distance a tip speaks for the surface beside it."""
QUORUM = 0.1
"""Part of a full patch's weight at which tips and kernel count alike."""


def tip_weights(
    xy_m: NDArray[np.float64], points_m: NDArray[np.float64], share: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (M, N): how much each tip speaks for each dot; rows add up to less than 1, to 0 far from the contact.

    `share` (N,) is 1 in the middle of the contact, 0 at its rim and beyond.
    """
    near = _nearness(xy_m, points_m)
    return _normalised(near, share)


def _nearness(xy_m: NDArray[np.float64], points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    square = (xy_m[:, 0, None] - points_m[0]) ** 2 + (xy_m[:, 1, None] - points_m[1]) ** 2
    return np.asarray(np.exp(-square / (2 * REACH_M**2)))


def _normalised(near: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.float64]:
    weights = near * share
    total = weights.sum(axis=1, keepdims=True)
    crowd = float(near.sum(axis=1).max(initial=1e-12))
    return np.asarray(weights / (total + QUORUM * crowd))


class MarkerField:
    """Marker displacements for one set of dots on one set of bristles."""

    def __init__(self, xy_m: NDArray[np.float64], points_m: NDArray[np.float64], kernel: MarkerKernel) -> None:
        self.xy_m = xy_m
        self._at_dots = kernel.matrix(xy_m, points_m)
        self._at_tips = kernel.matrix(points_m.T, points_m)
        self._near = _nearness(xy_m, points_m)
        self._share: NDArray[np.float64] | None = None
        self._weights = np.zeros_like(self._near)

    def displacement(
        self, force_n: NDArray[np.float64], tips_m: NDArray[np.float64], share: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return (M, 2) metres for point forces (3 N,) fx, fy, p and tip displacements (2, N)."""
        if self._share is None or not np.array_equal(share, self._share):
            self._share, self._weights = share, _normalised(self._near, share)
        missing = tips_m - (self._at_tips @ force_n).reshape(2, -1)
        return np.asarray((self._at_dots @ force_n).reshape(2, -1).T + self._weights.dot(missing.T))
