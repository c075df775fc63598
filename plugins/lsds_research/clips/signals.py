"""What a marker field does from frame to frame, in marker pitches and free of time.

A recording whose frame times are unknown has no speeds. What can be read off it is how far, and how evenly, the
markers have moved after one frame, three and six. Lengths are in pitches of the markers, so that a zoomed pad and a
whole one speak of the same thing. Nothing here looks at the image: only at the markers.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.tactile.motion_fit import fit_affine

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

LAGS = (1, 3, 6)
"""Frames over which changes are taken. The codec makes all dots jump at every 12th frame, by 0.08 px."""

_MOTION = ("net", "mean", "p90", "bent", "div", "curl", "strain", "even")
_SHAPE = ("held", "max", "spread", "bent", "bent_share", "div", "curl", "strain", "net")

CLIP_SIGNALS: tuple[str, ...] = (
    *(f"clip_{name}" for name in _SHAPE),
    *(f"clip_{name}_{lag}" for lag in LAGS for name in _MOTION),
)
"""Names of the signals. Of a frame's displacements and of their change over a lag: `net` norm of the mean, `mean`,
`p90` and `max` of the norms (`held` is the mean norm), `spread` of the norms, `bent` what the best affine motion leaves
(RMS; `bent_share` of the mean norm), `div`, `curl` and `strain` (the shear of the affine motion; unsigned, except for
the divergence of the displacements), `even` how far all markers go the same way, 0 to 1."""

_LEAST = 10
#: In pitches: a motion this small is noise, and has no direction.
_STILL = 3e-3


def lag_of(name: str) -> int:
    """Return how many frames a signal looks back."""
    tail = name.rpartition("_")[2]
    return int(tail) if tail.isdigit() else 0


def clip_signals(displacement: Floats, position: Floats) -> NDArray[np.float32]:
    """Return (frames, S) in the order of `CLIP_SIGNALS`, NaN where too few markers are seen.

    `displacement` (frames, N, 2), NaN where lost; `position` (N, 2) at rest; both in pitches.
    """
    columns = [_shapes(displacement, position)]
    columns += [_motions(displacement, position, lag) for lag in LAGS]
    return np.concatenate(columns, axis=1).astype(np.float32)


def _shapes(displacement: Floats, position: Floats) -> Floats:
    found = np.full((len(displacement), len(_SHAPE)), np.nan)
    for row, field in zip(found, displacement, strict=True):
        fitted = _fit(field, position)
        if fitted is not None:
            norm, (net, bent, div, curl, strain) = fitted
            held = float(norm.mean())
            share = bent / (held + 0.05)
            row[:] = held, float(norm.max()), float(norm.std()), bent, share, div, abs(curl), strain, net
    return found


def _motions(displacement: Floats, position: Floats, lag: int) -> Floats:
    found = np.full((len(displacement), len(_MOTION)), np.nan)
    for row, moved in zip(found[lag:], displacement[lag:] - displacement[:-lag], strict=False):
        fitted = _fit(moved, position)
        if fitted is not None:
            norm, (net, bent, div, curl, strain) = fitted
            mean = float(norm.mean())
            row[:] = net, mean, np.quantile(norm, 0.9), bent, abs(div), abs(curl), strain, net / (mean + _STILL)
    return found


def _fit(field: Floats, position: Floats) -> tuple[Floats, tuple[float, float, float, float, float]] | None:
    """Return the norms of the vectors seen, and net, residual, divergence, curl and strain of their affine motion."""
    seen = np.isfinite(field[:, 0])
    if np.count_nonzero(seen) < _LEAST:
        return None
    vectors = field[seen]
    motion = fit_affine(position[seen], vectors)
    if motion is None:
        return None
    (a, b), (c, d) = motion.gradient.tolist()
    bent = math.sqrt(float((motion.residual**2).sum()) / len(vectors))
    x, y = motion.translation.tolist()
    shape = math.hypot(x, y), bent, motion.divergence, motion.curl, math.hypot(a - d, b + c)
    return np.hypot(vectors[:, 0], vectors[:, 1]), shape
