"""An independent renderer of dotted gels for the tests: supersampled disks, so that nothing of the product draws them.

Deliberately different from the mock's optics (stamps): a shared mistake would hide a biased tracker.
"""

from __future__ import annotations

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


def background():
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    u, v = x / WIDTH - 0.5, y / HEIGHT - 0.5
    return np.stack(
        [
            55 + 60 * np.exp(-4 * (u**2 + v**2)) + 25 * v,
            115 + 20 * np.exp(-4 * (u**2 + v**2)),
            112 + 14 * np.exp(-4 * u**2) - 20 * v,
        ],
        axis=-1,
    )


def render(xy, *, diameter=13.0, core=0.31, blur=0.9, noise=1.0, gain=1.0, shade=None, seed=0):
    """RGB uint8 (240, 320, 3): soft-edged disks (edge sigma `blur` px) by 4x4 supersampling on a lit background."""
    rng = np.random.default_rng(seed)
    cover = np.zeros((HEIGHT, WIDTH))
    sub = (np.arange(4) + 0.5) / 4 - 0.5
    half = int(diameter / 2 + 5)
    for cx, cy in np.asarray(xy, float):
        if not (np.isfinite(cx) and np.isfinite(cy)):
            continue
        x0, y0 = round(cx) - half, round(cy) - half
        xs, ys = np.arange(x0, x0 + 2 * half + 1), np.arange(y0, y0 + 2 * half + 1)
        xs, ys = xs[(xs >= 0) & (xs < WIDTH)], ys[(ys >= 0) & (ys < HEIGHT)]
        if not len(xs) or not len(ys):
            continue
        px = (xs[:, None] + sub).ravel() - cx
        py = (ys[:, None] + sub).ravel() - cy
        r = np.hypot(px[None, :], py[:, None])
        soft = 1 / (1 + np.exp((r - diameter / 2) / (blur * 0.6)))
        patch = soft.reshape(len(ys), 4, len(xs), 4).mean((1, 3))
        view = cover[ys[0] : ys[-1] + 1, xs[0] : xs[-1] + 1]
        np.maximum(view, patch, out=view)
    image = background() * gain
    if shade is not None:
        image = image + shade
    image = image * (1 - (1 - core) * cover[..., None])
    if noise:
        image = image + noise * rng.standard_normal(image.shape) * np.array([2.0, 1.1, 2.0])
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)
