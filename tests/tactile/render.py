"""An independent renderer of dotted gels for the tests: supersampled disks, so that nothing of the product draws them.

Deliberately different from the mock's optics (stamps): a shared mistake would hide a biased tracker.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

HEIGHT, WIDTH = 240, 320


def pad_positions(rows=7, cols=9, pitch=(33.0, 32.0), pincushion=0.04, angle=0.0, jitter=0.15, seed=0, centre=None):
    """Dot centres (N, 2) px of a printed pad: regular grid, pincushion, rotation, printing jitter."""
    rng = np.random.default_rng(seed)
    c, r = np.meshgrid(np.arange(cols) - (cols - 1) / 2, np.arange(rows) - (rows - 1) / 2)
    xy = np.stack([c.ravel() * pitch[0], r.ravel() * pitch[1]], axis=1)
    radius2 = (xy**2).sum(1, keepdims=True) / (160.0**2)
    xy = xy * (1 + pincushion * (radius2 - 0.5))
    cos, sin = np.cos(angle), np.sin(angle)
    xy = xy @ np.array([[cos, sin], [-sin, cos]])
    xy += jitter * rng.standard_normal(xy.shape)
    return xy + (np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2]) if centre is None else centre)


@lru_cache(maxsize=1)
def background():
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    u, v = x / WIDTH - 0.5, y / HEIGHT - 0.5
    light = [
        55 + 60 * np.exp(-4 * (u**2 + v**2)) + 25 * v,
        115 + 20 * np.exp(-4 * (u**2 + v**2)),
        112 + 14 * np.exp(-4 * u**2) - 20 * v,
    ]
    return np.stack(light, axis=-1).astype(np.float32)


@lru_cache(maxsize=40)
def grain(seed):
    """Sensor noise (240, 320, 3) in grey levels; most tests look at frames of the same few seeds."""
    levels = np.random.default_rng(seed).standard_normal((HEIGHT, WIDTH, 3)) * np.array([2.0, 1.1, 2.0])
    return levels.astype(np.float32)


def disks(xy, diameter, blur):
    """How much of each pixel (240, 320) dots cover: edges of sigma `blur` px, 4x4 supersampling."""
    half = int(diameter / 2 + 5)
    size = 2 * half + 1
    # Around the image is room for what dots on its border have outside.
    cover = np.zeros((HEIGHT + 2 * size, WIDTH + 2 * size), np.float32)
    xy = np.asarray(xy, float).reshape(-1, 2)
    xy = xy[((xy > -half) & (xy < np.array([WIDTH + half, HEIGHT + half]))).all(axis=1)]
    middle = np.rint(xy).astype(int)
    sub = (np.arange(4 * size) + 0.5) / 4 - 0.5 - half
    square = (sub + (middle - xy)[..., None]).astype(np.float32) ** 2
    steep = np.float32(1 / (blur * 0.6))
    for (x, y), (across, down) in zip(middle + size - half, square, strict=True):
        soft = np.sqrt(across + down[:, None])
        soft -= np.float32(diameter / 2)
        soft *= steep
        np.exp(soft, out=soft)
        soft += 1
        np.reciprocal(soft, out=soft)
        columns = soft[:, 0::4] + soft[:, 1::4] + soft[:, 2::4] + soft[:, 3::4]
        patch = (columns[0::4] + columns[1::4] + columns[2::4] + columns[3::4]) / 16
        view = cover[y : y + size, x : x + size]
        np.maximum(view, patch, out=view)
    return cover[size:-size, size:-size]


def render(xy, *, diameter=13.0, core=0.31, blur=0.9, noise=1.0, gain=1.0, shade=None, seed=0):
    """RGB uint8 (240, 320, 3): soft-edged disks on a lit background."""
    image = background() * np.float32(gain)
    if shade is not None:
        image += shade
    image *= (1 - (1 - core) * disks(xy, diameter, blur))[..., None]
    if noise:
        image += np.float32(noise) * grain(seed)
    np.rint(image, out=image)
    return np.clip(image, 0, 255, out=image).astype(np.uint8)
