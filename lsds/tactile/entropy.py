"""Shannon entropy of the histogram of marker displacements (Yuan 2015, Hu 2023), with fixed bins.

Bins are `BIN_M` wide from zero; the last of `ENTROPY_BINS` is open. Natural logarithm: H lies in
[0, log(number of markers)].
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Width of a bin, m: half a pixel of the GelSight Mini (0.0625 mm per pixel).
BIN_M = 31.25e-6
#: Number of bins.
ENTROPY_BINS = 64
#: Counts whose n log n is tabulated; a dense tracker has up to 60 x 80 points.
_COUNTS = np.arange(1, 8193)
_N_LOG_N = np.concatenate([[0.0], _COUNTS * np.log(_COUNTS)])


def displacement_entropy(magnitude_m: NDArray[np.float64]) -> float:
    """Return H in nats of displacement norms (N,), all finite; NaN for none. H = log N - (1/N) sum n log n."""
    count = len(magnitude_m)
    if not count:
        return np.nan
    bins = np.minimum(magnitude_m * (1.0 / BIN_M), ENTROPY_BINS - 1).astype(np.intp)
    occupied = np.bincount(bins, minlength=ENTROPY_BINS)
    return max(0.0, math.log(count) - float(_N_LOG_N[occupied].sum()) / count)
