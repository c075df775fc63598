"""Displacement of the gel's surface around a point force.

For a tangential force f at distance vector r: u = [sum_j a_j g_j(r) + b_j g_j(r) r r^T / l_j^2] f, for a normal force
p pressing into the gel: u = sum_j c_j g_j(r) r / l_j p, with Gaussians g_j = exp(-r^2 / 2 l_j^2) of four lengths. The
twelve coefficients are a least-squares fit to the finite-pad reference solution (E = 0.2 MPa; they scale with 1/E).
The kernel depends on distance only, so it does not model the pad's walls. `lsds_mocks.gel.markers` corrects it under
the contact; the coefficients were fitted with that correction in place.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

KERNEL_LENGTHS_M = (1.0e-3, 2.0e-3, 4.0e-3, 8.0e-3)
"""Lengths l_j of the kernel's Gaussians, m; chosen, and the coefficients are fitted for them."""


def basis(xy_m: NDArray[np.float64], points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the kernel's twelve parts, (12, 2 M, 3 N): rows x then y of each marker, columns fx, fy, p of each
    point; `xy_m` (M, 2), `points_m` (2, N)."""
    x = xy_m[:, 0, None] - points_m[0]
    y = xy_m[:, 1, None] - points_m[1]
    markers, points = x.shape
    parts = np.zeros((3 * len(KERNEL_LENGTHS_M), 2 * markers, 3 * points))
    for j, length in enumerate(KERNEL_LENGTHS_M):
        g = np.exp(-(x * x + y * y) / (2 * length**2))
        parts[j, :markers, :points] = parts[j, markers:, points : 2 * points] = g
        k = j + len(KERNEL_LENGTHS_M)
        parts[k, :markers, :points] = g * x * x / length**2
        parts[k, markers:, points : 2 * points] = g * y * y / length**2
        parts[k, :markers, points : 2 * points] = parts[k, markers:, :points] = g * x * y / length**2
        k += len(KERNEL_LENGTHS_M)
        parts[k, :markers, 2 * points :] = g * x / length
        parts[k, markers:, 2 * points :] = g * y / length
    return parts


@dataclass(frozen=True, slots=True)
class MarkerKernel:
    """The fitted coefficients, metres per newton."""

    coefficients: tuple[float, ...]

    def matrix(self, xy_m: NDArray[np.float64], points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (2 M, 3 N) matrix from point forces to marker displacements."""
        matrix: NDArray[np.float64] = np.tensordot(np.array(self.coefficients), basis(xy_m, points_m), axes=1)
        return matrix

    def scaled(self, softness: float) -> MarkerKernel:
        """Return the kernel of a gel `softness` times as soft as the reference."""
        return MarkerKernel(tuple(softness * c for c in self.coefficients))


DEFAULT_KERNEL = MarkerKernel(
    (
        *(4.021e-3, -1.258e-3, 4.961e-4, -1.084e-4),
        *(-4.281e-4, 6.28e-4, 6.991e-5, 1.117e-4),
        *(2.307e-4, 6.499e-5, 6.69e-5, 3.932e-5),
    )
)
