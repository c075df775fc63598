"""Dots that the image border cuts: matched on their visible part.

Lucas-Kanade on a whole window reads reflected pixels beyond the border and is biased towards it by up to a tenth of
a pixel. Here pixels outside the image have no say.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Gauss-Newton steps of a registration; chosen.
_CUT_ITERATIONS = 3


class CutDots:
    """Gauss-Newton registration of windows of the reference to this image, masked to the image (Baker and
    Matthews, 2004, inverse compositional form)."""

    def __init__(self, grey: NDArray[np.uint8], xy_px: NDArray[np.float64], diameter_px: float) -> None:
        self._radius = radius = int(diameter_px / 2 + 3)
        self._reach = diameter_px / 2 + 0.5
        dy, dx = np.mgrid[-radius : radius + 1, -radius : radius + 1]
        self._dx, self._dy = dx.ravel().astype(np.float64), dy.ravel().astype(np.float64)
        image = grey.astype(np.float64)
        self._template = _sample(image, xy_px[:, :1] + self._dx, xy_px[:, 1:] + self._dy)
        gradient_y, gradient_x = (np.asarray(g, np.float64) for g in np.gradient(image))
        at_x, at_y = xy_px[:, :1] + self._dx, xy_px[:, 1:] + self._dy
        self._gradient = np.stack([_sample(gradient_x, at_x, at_y), _sample(gradient_y, at_x, at_y)], axis=-1)

    def refine(self, grey: NDArray[np.uint8], xy_px: NDArray[np.float64]) -> None:
        """Refine in place those of the positions (N, 2) whose dots the border cuts."""
        height, width = grey.shape
        limit = np.array([width - 1, height - 1])
        whole = (xy_px >= self._reach) & (xy_px <= limit - self._reach)
        if whole.all():
            return
        cut = np.flatnonzero(~whole.all(axis=1) & (xy_px >= 0).all(axis=1) & (xy_px <= limit).all(axis=1))
        if not len(cut):
            return
        template, gradient, start = self._template[cut], self._gradient[cut], xy_px[cut]
        # The mask stays that of the start: a set of pixels that changes under way need not converge.
        x, y = start[:, :1] + self._dx, start[:, 1:] + self._dy
        inside = (x >= 0) & (y >= 0) & (x <= limit[0]) & (y <= limit[1])
        weighted = gradient * inside[..., None]
        hessian = weighted.transpose(0, 2, 1) @ gradient + 1e-6 * np.eye(2)
        inverse = np.linalg.inv(hessian)
        left, top = max(0, int(x.min())), max(0, int(y.min()))
        image = grey[top : int(y.max()) + 3, left : int(x.max()) + 3].astype(np.float64)
        # Brightness common to the window is no motion; where only half a dot is left, it would pass for one.
        level = np.einsum("kp,kp->k", template, inside)
        at = start.copy()
        for _ in range(_CUT_ITERATIONS):
            now = _sample(image, at[:, :1] + self._dx - left, at[:, 1:] + self._dy - top)
            now *= (level / np.maximum(np.einsum("kp,kp->k", now, inside), 1.0))[:, None]
            slope = np.einsum("kpi,kp->ki", weighted, now - template)
            at -= np.einsum("kij,kj->ki", inverse, slope)
        near = np.abs(at - start).max(axis=1) < self._radius
        xy_px[cut[near]] = at[near]


def _sample(image: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bilinear samples of an image, the border value beyond it."""
    height, width = image.shape
    x = np.clip(x, 0, width - 1.001)
    y = np.clip(y, 0, height - 1.001)
    column, row = x.astype(np.intp), y.astype(np.intp)
    fx, fy = x - column, y - row
    flat = image.ravel()
    at = row * width + column
    upper = flat[at] * (1 - fx) + flat[at + 1] * fx
    lower = flat[at + width] * (1 - fx) + flat[at + width + 1] * fx
    return np.asarray(upper * (1 - fy) + lower * fy)
