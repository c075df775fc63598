"""A gel with an object's imprint, painted by the photometric model with given motions of object and gel."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from lsds.contracts import DeformationField, Frame, MarkerReference
from lsds.tactile.depth import PhotometricCalibration

HEIGHT, WIDTH, PITCH, METRES_PER_PX = 240, 320, 32.0, 6.25e-5
_FINE = 2
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """Translation (px) and turn (rad, clockwise) about the image's centre."""

    x: float = 0.0
    y: float = 0.0
    turn: float = 0.0

    def undone(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return the earlier positions of points of the moved plane."""
        cos, sin = np.cos(self.turn), np.sin(self.turn)
        dx, dy = x - self.x - WIDTH / 2, y - self.y - HEIGHT / 2
        return cos * dx + sin * dy + WIDTH / 2, cos * dy - sin * dx + HEIGHT / 2


def bumps(seed: int = 0, count: int = 40, size_px: float = 5.0) -> Floats:
    """Return the depth (h, w) in px of an uneven object within 70 px of the image's centre."""
    rng = np.random.default_rng(seed)
    x, y = _grid(_FINE)
    depth = np.zeros_like(x)
    for angle, radius, high in zip(
        rng.uniform(0, 6.28, count), 70 * rng.uniform(0, 1, count) ** 0.5, rng.uniform(0.3, 1, count), strict=True
    ):
        away = (x - WIDTH / 2 - radius * np.cos(angle)) ** 2 + (y - HEIGHT / 2 - radius * np.sin(angle)) ** 2
        depth += high * np.exp(-away / 2 / size_px**2)
    return depth


def ridge(size_px: float = 5.0) -> Floats:
    """Return the depth (h, w) of a ridge along y through the whole image: it does not determine motion along y."""
    x, _ = _grid(_FINE)
    return np.asarray(2.0 * np.exp(-((x - WIDTH / 2) ** 2) / 2 / size_px**2))


def painted(depth: Floats, body: Motion, gel: Motion, *, seed: int = 0, noise: float = 1.0, seq: int = 0) -> Frame:
    """Return the image of an object of that depth and of the gel's markers, with separate motions."""
    x, y = _grid(1)
    at = [np.asarray(part * _FINE, np.float32) for part in body.undone(x, y)]
    seen = cv2.remap(depth.astype(np.float32), at[0], at[1], cv2.INTER_CUBIC)
    slope = np.stack(
        [cv2.Sobel(seen, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(seen, cv2.CV_32F, 0, 1, scale=1 / 8)], -1
    )
    light = np.array([100.0, 115.0, 110.0])
    image = light * (1 + slope @ np.array(PhotometricCalibration().levels_per_slope).T / 100)
    from_x, from_y = gel.undone(x, y)
    away = np.hypot((from_x - PITCH / 2) % PITCH - PITCH / 2, (from_y - PITCH / 2) % PITCH - PITCH / 2)
    image *= (1 - 0.7 / (1 + np.exp((away - 6.0) / 0.7)))[..., None]
    image += noise * np.random.default_rng([seed, seq]).standard_normal(image.shape)
    return Frame(np.clip(np.rint(image), 0, 255).astype(np.uint8), seq * 40_000_000, seq)


def field(gel: Motion, reference: MarkerReference, seq: int = 0) -> DeformationField:
    """Return the markers' field after a motion of the gel."""
    rest = reference.xy_px
    cos, sin = np.cos(gel.turn), np.sin(gel.turn)
    dx, dy = rest[:, 0] - WIDTH / 2, rest[:, 1] - HEIGHT / 2
    moved = np.column_stack([cos * dx - sin * dy + WIDTH / 2 + gel.x, sin * dx + cos * dy + HEIGHT / 2 + gel.y])
    displacement = (moved - rest) * METRES_PER_PX
    valid = np.ones(len(rest), bool)
    position = (rest - (WIDTH / 2, HEIGHT / 2)) * METRES_PER_PX
    return DeformationField(seq, seq, 0.04, reference, position, displacement, displacement * np.nan, valid)


def dots() -> MarkerReference:
    """Return the reference of the painted markers."""
    rows, columns = int(HEIGHT / PITCH), int(WIDTH / PITCH)
    cell = np.array([(row, column) for row in range(rows) for column in range(columns)])
    xy = PITCH / 2 + PITCH * cell[:, ::-1].astype(float)
    return MarkerReference(xy, cell, (rows, columns), (PITCH, PITCH), np.eye(2), (WIDTH, HEIGHT))


def _grid(fine: int) -> tuple[Floats, Floats]:
    y, x = np.mgrid[: HEIGHT * fine, : WIDTH * fine] / fine
    return x, y
