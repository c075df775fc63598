"""Camera effects in a clip: noise without motion, its correlation, brightness drift, dim first frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

CHANNELS = ("red", "green", "blue")
STILL_FRAMES = 12
"""Length of a stretch; recordings in the public set have a key frame every twelve frames."""
STRETCHES = 8
"""How many stretches of a clip are looked at; the stillest counts."""
SETTLED = slice(3, 9)
"""Frames (from 0) against which the first one is dim: by the third frame brightness has settled."""
DIM_GAIN = 0.85
DRIFT_S, RATE_HZ = 15.0, 25.0


def camera_row(images: Iterable[NDArray[np.uint8]]) -> dict[str, float | bool | None]:
    """Return one clip's figures; images are (H, W, 3) uint8 RGB, in order.

    `sigma_*` (levels): standard deviation over time of a pixel, median over pixels of the stillest stretch.
    `repeated`: share of a still stretch's pixels that equal those of the frame before, which is what compression does.
    `lag1`: correlation of neighbouring pixels' changes. `drift_levels`: change of mean brightness over 15 s at the
    nominal rate, None in shorter clips than a third of that. `dim`: opens dim and red.
    """
    frames = [np.ascontiguousarray(image[::2]) for image in images]
    means = np.array([frame.mean(axis=(0, 1)) for frame in frames])
    noise = _stillest(frames)
    row: dict[str, float | bool | None] = {f"sigma_{name}": None for name in CHANNELS}
    row |= {"lag1": None, "repeated": None}
    if noise is not None:
        sigma = np.median(noise.std(axis=0, ddof=1), axis=(0, 1))
        row |= {f"sigma_{name}": float(value) for name, value in zip(CHANNELS, sigma, strict=True)}
        changes = np.diff(noise, axis=0)
        row["lag1"] = _lag1(changes)
        row["repeated"] = float(np.mean((changes == 0).all(axis=3)))
    row["drift_levels"] = _drift(means.mean(axis=1))
    row["dim"] = bool(_is_dim(means)) if len(means) > SETTLED.stop else None
    return row


def camera_table(rows: Sequence[dict[str, float | bool | None]]) -> dict[str, float | None]:
    """Return medians over the clips, the 90th percentile of the drift, and the share that opens dim and red."""
    keys = (*(f"sigma_{name}" for name in CHANNELS), "lag1", "repeated", "drift_levels")
    table: dict[str, float | None] = {"clips": float(len(rows))}
    table |= {key: _quantile(rows, key, 50) for key in keys}
    table["drift_levels_p90"] = _quantile(rows, "drift_levels", 90)
    known = [row["dim"] for row in rows if row["dim"] is not None]
    table["dim_share"] = float(np.mean(known)) if known else None
    return table


def _stillest(frames: Sequence[NDArray[np.uint8]]) -> NDArray[np.float32] | None:
    """Return (STILL_FRAMES, H, W, 3) of the stretch in which least happens, None in a shorter clip."""
    last = len(frames) - STILL_FRAMES
    if last < SETTLED.start:
        return None
    starts = np.unique(np.linspace(SETTLED.start, last, STRETCHES).astype(int))
    stretches = [np.array(frames[s : s + STILL_FRAMES], np.float32) for s in starts]
    # Motion shows in the worst pixels between the stretch's ends, noise everywhere alike.
    moved = [float(np.percentile(np.abs(s[-1] - s[0]).sum(axis=2), 99)) for s in stretches]
    return stretches[int(np.argmin(moved))]


def _lag1(changes: NDArray[np.float32]) -> float | None:
    left, right = changes[:, :, :-1].ravel(), changes[:, :, 1:].ravel()
    if not left.any():
        return None
    return float(np.mean(left * right) / np.mean(changes**2))


def _drift(brightness: NDArray[np.float64]) -> float | None:
    """Return the change over 15 s by a straight line through the settled clip: levels, without sign."""
    settled = brightness[SETTLED.start :]
    t_s = np.arange(len(settled)) / RATE_HZ
    if len(settled) < 2 or t_s[-1] < DRIFT_S / 3:
        return None
    return float(abs(np.polyfit(t_s, settled, 1)[0]) * DRIFT_S)


def _is_dim(means: NDArray[np.float64]) -> bool:
    gain = means[0] / np.maximum(np.median(means[SETTLED], axis=0), 1.0)
    return bool(gain[1] < DIM_GAIN and gain[2] < DIM_GAIN and gain[0] > max(gain[1], gain[2]))


def _quantile(rows: Sequence[dict[str, float | bool | None]], key: str, q: float) -> float | None:
    values = [float(value) for row in rows if (value := row[key]) is not None]
    return float(np.percentile(values, q)) if values else None
