"""Causal windows over a dataset, identical to those of `lsds.models.window` online.

A frame with an undefined signal (the first, or one with most markers lost) is not in any window and gets no prediction.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.datasets import Dataset


def windows(data: Dataset, names: Sequence[str], length: int) -> tuple[NDArray[np.float32], NDArray[np.intp]]:
    """Return windows (n, length, F), oldest frame first, and the rows (n,) of their last frames.

    At the start of a recording the first usable frame is repeated, as it is online.
    """
    values = data.signals(names)
    usable: NDArray[np.bool_] = np.asarray(np.isfinite(values).all(axis=1))
    starts = data.starts
    taken: list[NDArray[np.intp]] = []
    rows: list[NDArray[np.intp]] = []
    for first, end in pairwise(starts.tolist()):
        own = first + np.flatnonzero(usable[first:end])
        if len(own):
            back = np.arange(len(own))[:, None] + np.arange(1 - length, 1)
            taken.append(own[np.maximum(back, 0)])
            rows.append(own)
    if not rows:
        return np.zeros((0, length, len(names)), np.float32), np.zeros(0, np.intp)
    return values[np.concatenate(taken)], np.concatenate(rows)
