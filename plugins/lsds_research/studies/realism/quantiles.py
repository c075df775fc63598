"""Two samples side by side: their quantiles, and how much of one lies where the other does."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

QUANTILES = (5, 25, 50, 75, 95, 99)
MOST_BINS = 20


def quantiles(values: Floats) -> dict[str, float | None]:
    """Return the quantiles by name, p5 to p99; None where there are no values."""
    if not len(values):
        return {f"p{q}": None for q in QUANTILES}
    return {f"p{q}": float(v) for q, v in zip(QUANTILES, np.percentile(values, QUANTILES), strict=True)}


def overlap(a: Floats, b: Floats) -> float:
    """Return the overlap coefficient of two samples: 0 where they share no bin, 1 where their histograms are the same.

    The bins hold equal shares of both samples together, each sample counting alike however large it is: 20, or fewer
    where a sample is small, as empty bins would pass for a difference. A value that many share has a bin of its own.
    """
    if not len(a) or not len(b):
        return 0.0
    bins = max(2, min(MOST_BINS, math.isqrt(min(len(a), len(b)))))
    grid = np.linspace(0, 1, 501)
    # The same number of values of each: quantiles represent the sample.
    both = np.concatenate([np.quantile(a, grid, method="nearest"), np.quantile(b, grid, method="nearest")])
    edges = np.unique(np.quantile(both, np.arange(1, bins) / bins, method="lower"))
    # Bins are open below and closed above, with an infinite one at either end.
    share_a, share_b = _shares(a, edges), _shares(b, edges)
    return float(np.minimum(share_a, share_b).sum())


def inside(simulated: Floats, real: Floats) -> float:
    """Return the share of simulated values within the real 5 to 95 % range: 0.9 where both are distributed alike."""
    if not len(simulated) or not len(real):
        return 0.0
    low, high = np.percentile(real, (5, 95))
    return float(np.mean((simulated >= low) & (simulated <= high)))


def _shares(values: Floats, edges: Floats) -> Floats:
    counts = np.bincount(np.searchsorted(edges, values, side="left"), minlength=len(edges) + 1)
    return np.asarray(counts / len(values))
