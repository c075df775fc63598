"""Augmentation of examples by rotation and mirroring, because a gel is isotropic.

The protocols slide along one axis of the sensor only. Without augmentation, a model assigns every slip to that axis.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds_research.learners.compression import Compression

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

VECTORS = (("shear_x", "shear_y"), ("v_x", "v_y"), ("imprint_slip_x", "imprint_slip_y"), ("imprint_v_x", "imprint_v_y"))
ODD = (
    "twist",
    "angular_velocity",
    "rotation",
    "curl_sum",
    "curl_mean",
    "curl_affine",
    "curl_sum_rate",
    "curl_mean_rate",
    "imprint_turn",
    "imprint_rate",
)
"""Signals that change their sign when mirrored."""
DIRECTED = ("theta", "theta_delta")
"""Signals with a direction whose transformation is not defined here."""


class Symmetry:
    """Effect of rotation and mirroring on named signals (F,)."""

    def __init__(self, signals: Sequence[str]) -> None:
        at = {name: index for index, name in enumerate(signals)}
        halves = [sum(name in at for name in pair) == 1 for pair in VECTORS]
        self._vectors = [(at[x], at[y]) for x, y in VECTORS if x in at and y in at]
        self._odd = [at[name] for name in ODD if name in at]
        self.known = bool(self._vectors) and not any(halves) and not any(name in at for name in DIRECTED)
        """Whether some signal has a direction and the transformation of every signal is known."""

    def compression(self, x: NDArray[np.float32], y: NDArray[np.float32], seed: int) -> Compression:
        """Return a compression in which both components of a vector have the unit of randomly rotated examples."""
        return Compression.fit(self.turned(x, y, np.random.default_rng(seed))[0] if self.known else x)

    def turned(
        self, x: NDArray[np.float32], y: NDArray[np.float32], rng: np.random.Generator, share: float = 1.0
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return windows (n, length, F) and labels (n, 3) with a random share rotated by any angle, every second
        of these mirrored before."""
        x, y = x.copy(), y.copy()
        chosen = np.flatnonzero(rng.random(len(x)) < share)
        angle = rng.uniform(0, 2 * np.pi, len(chosen)).astype(np.float32)
        mirror = np.where(rng.random(len(chosen)) < 0.5, np.float32(-1), np.float32(1))
        cos, sin = np.cos(angle), np.sin(angle)
        own, labels = x[chosen], y[chosen]
        for i, j in self._vectors:
            along, across = own[:, :, i], own[:, :, j] * mirror[:, None]
            own[:, :, i], own[:, :, j] = _turned(along, across, cos[:, None], sin[:, None])
        own[:, :, self._odd] *= mirror[:, None, None]
        labels[:, 0], labels[:, 1] = _turned(labels[:, 0], labels[:, 1] * mirror, cos, sin)
        labels[:, 2] *= mirror
        x[chosen], y[chosen] = own, labels
        return x, y


def _turned(
    x: NDArray[np.float32], y: NDArray[np.float32], cos: NDArray[np.float32], sin: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    return np.asarray(cos * x - sin * y, np.float32), np.asarray(sin * x + cos * y, np.float32)
