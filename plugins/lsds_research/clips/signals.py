"""Signals of a marker field that need no frame times; lengths are in marker pitches.

A recording without frame times has no speeds. It does show how far, and how evenly, the markers move within one, three
and six frames. Lengths in marker pitches are comparable between a zoomed and a whole pad. The signals use the markers
only, not the image.
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
"""Lags of the changes, in frames. The codec shifts all markers by 0.08 px at every 12th frame."""

_MOTION = ("net", "mean", "p90", "bent", "div", "curl", "strain", "even")
_SHAPE = ("held", "max", "spread", "bent", "bent_share", "div", "curl", "strain", "net")

CLIP_SIGNALS: tuple[str, ...] = (
    *(f"clip_{name}" for name in _SHAPE),
    *(f"clip_{name}_{lag}" for lag in LAGS for name in _MOTION),
)
"""Names of the signals, of a frame's displacements and of their change over a lag.

`net` is the norm of the mean; `mean`, `p90`, `max` and `spread` are statistics of the norms (`held` is the mean norm of
the displacements). `bent` is the RMS residual of the best affine motion, `bent_share` its ratio to the mean norm.
`div`, `curl` and `strain` (shear) are of the affine motion, unsigned except for the divergence of the displacements.
`even`, 0 to 1, is 1 if all markers move the same way.
"""

#: Minimum number of visible markers for an affine fit of a frame's motion; chosen.
_LEAST_MARKERS_SEEN = 10
#: Smaller motion is noise and has no direction (pitches).
_STILL_PITCHES = 3e-3


def lag_of(name: str) -> int:
    """Return the lag of a signal, in frames."""
    tail = name.rpartition("_")[2]
    return int(tail) if tail.isdigit() else 0


def clip_signals(displacement: Floats, position: Floats) -> NDArray[np.float32]:
    """Return (frames, S) in the order of `CLIP_SIGNALS`, NaN for too few visible markers.

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
            row[:] = net, mean, np.quantile(norm, 0.9), bent, abs(div), abs(curl), strain, net / (mean + _STILL_PITCHES)
    return found


def _fit(field: Floats, position: Floats) -> tuple[Floats, tuple[float, float, float, float, float]] | None:
    """Return the norms of the visible markers' vectors, and net, residual, divergence, curl and strain of their affine
    motion."""
    seen = np.isfinite(field[:, 0])
    if np.count_nonzero(seen) < _LEAST_MARKERS_SEEN:
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
