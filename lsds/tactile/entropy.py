"""Shannon entropy of the marker displacements' histogram (Yuan 2015, Hu 2023), with bins that are fixed.

Bins are `BIN_M` wide from zero; the last of `BINS` is open. Natural logarithm: H lies in [0, log(number of markers)].
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Half a pixel at the Mini's 0.0625 mm a pixel.
BIN_M = 31.25e-6
BINS = 64
#: n log n for every possible count: a frame's entropy is then one histogram and one look-up.
#: Up to the 60 x 80 sample points that a dense tracker may have, and some.
_COUNTS = np.arange(1, 8193)
_N_LOG_N = np.concatenate([[0.0], _COUNTS * np.log(_COUNTS)])


def displacement_entropy(magnitude_m: NDArray[np.float64]) -> float:
    """Return H in nats of displacement norms (N,), all finite; NaN for none. H = log N - (1/N) sum n log n."""
    count = len(magnitude_m)
    if not count:
        return np.nan
    bins = np.minimum(magnitude_m * (1.0 / BIN_M), BINS - 1).astype(np.intp)
    occupied = np.bincount(bins, minlength=BINS)
    return max(0.0, math.log(count) - float(_N_LOG_N[occupied].sum()) / count)
