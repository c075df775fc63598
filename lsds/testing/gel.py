"""Images of a gel with printed markers, and of what an object presses into it, drawn from exact positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lsds.contracts import SensorSpec

SPEC = SensorSpec(width_px=320, height_px=240, rate_hz=25.0, metres_per_px=62.5e-6, pad=(7, 9))
"""The sensor that the kit draws the images of."""
PITCH_PX = 32.0
"""Distance of the markers, px."""
CENTRE_PX = np.array([(SPEC.width_px - 1) / 2, (SPEC.height_px - 1) / 2])
MARKER_PX = 6.0
"""Radius of a marker, px."""
MARKER_EDGE_PX = 0.6
"""Width of a marker's edge, px."""
MARKER_DARKNESS = 0.65
"""Share of the light that a marker takes."""
LIGHT = (110.0, 130.0, 115.0)
"""Light of the gel without markers, grey levels of red, green and blue."""
IMAGE_NOISE = 1.5
"""Standard deviation of the image noise, grey levels."""
CONTACT_PX = 75.0
"""Radius of the contact patch."""
SHADE_X, SHADE_Y = np.array([-14.0, 84.0, 11.0]), np.array([-88.0, 9.0, 62.0])
"""Change of R, G, B by a slope of one along x and y."""


@dataclass(frozen=True)
class Press:
    """An object in contact: how far it has moved (px) and turned (rad), and its depth as a share of the full one."""

    x_px: float = 0.0
    y_px: float = 0.0
    turn_rad: float = 0.0
    depth: float = 1.0


def grid_px() -> NDArray[np.float64]:
    """Return the positions (N, 2) of the markers of the gel at rest, row by row."""
    rows, columns = SPEC.pad or (0, 0)
    row, column = np.divmod(np.arange(rows * columns), columns)
    steps = np.stack([column - (columns - 1) / 2, row - (rows - 1) / 2], axis=1)
    return np.asarray(CENTRE_PX + PITCH_PX * steps)


def draw(markers_px: NDArray[np.float64], press: Press | None = None, seed: int = 0) -> NDArray[np.uint8]:
    """Return an RGB image (height, width, 3), uint8 and read-only, of markers (N, 2); NaN rows are not drawn."""
    y, x = np.mgrid[0 : SPEC.height_px, 0 : SPEC.width_px].astype(np.float64)
    image = (
        np.array(LIGHT) * (1 - 0.25 * (((x - CENTRE_PX[0]) / 320) ** 2 + ((y - CENTRE_PX[1]) / 240) ** 2))[..., None]
    )
    if press is not None:
        slope_x, slope_y = _slopes(x, y, press)
        image += slope_x[..., None] * SHADE_X + slope_y[..., None] * SHADE_Y
    image *= (1 - MARKER_DARKNESS * _cover(markers_px))[..., None]
    image += IMAGE_NOISE * np.random.default_rng(seed).standard_normal(image.shape)
    drawn: NDArray[np.uint8] = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    drawn.flags.writeable = False
    return drawn


def _cover(markers_px: NDArray[np.float64]) -> NDArray[np.float64]:
    cover = np.zeros((SPEC.height_px, SPEC.width_px))
    reach = int(MARKER_PX + 6 * MARKER_EDGE_PX)
    for x, y in markers_px[np.isfinite(markers_px).all(axis=1)]:
        left, top = max(int(x) - reach, 0), max(int(y) - reach, 0)
        patch = cover[top : max(int(y) + reach + 1, 0), left : max(int(x) + reach + 1, 0)]
        across = np.arange(patch.shape[1]) + left - x
        down = np.arange(patch.shape[0]) + top - y
        radius = np.hypot(across, down[:, None])
        np.maximum(patch, 1 / (1 + np.exp((radius - MARKER_PX) / MARKER_EDGE_PX)), out=patch)
    return cover


def _slopes(
    x: NDArray[np.float64], y: NDArray[np.float64], press: Press
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the slopes of the gel under an object whose surface is a sum of waves, fixed to the object."""
    cos, sin = np.cos(press.turn_rad), np.sin(press.turn_rad)
    right, down = x - CENTRE_PX[0] - press.x_px, y - CENTRE_PX[1] - press.y_px
    u, v = cos * right + sin * down, cos * down - sin * right
    slope_u, slope_v = np.zeros_like(u), np.zeros_like(v)
    rng = np.random.default_rng(7)
    for _ in range(10):
        wave = 2 * np.pi / rng.uniform(14, 40) * np.array([np.cos(a := rng.uniform(0, np.pi)), np.sin(a)])
        phase = np.cos(wave[0] * u + wave[1] * v + rng.uniform(0, 2 * np.pi))
        slope_u += 0.25 * wave[0] * phase
        slope_v += 0.25 * wave[1] * phase
    # The patch stays where the finger is, and its surface moves with the object.
    radius2 = ((x - CENTRE_PX[0]) ** 2 + (y - CENTRE_PX[1]) ** 2) / CONTACT_PX**2
    inside = press.depth / (1 + np.exp(np.clip(12 * (radius2 - 1), -50, 50)))
    dome = 0.12 * inside
    return (
        inside * (cos * slope_u - sin * slope_v) - dome * (x - CENTRE_PX[0]) / CONTACT_PX,
        inside * (sin * slope_u + cos * slope_v) - dome * (y - CENTRE_PX[1]) / CONTACT_PX,
    )
