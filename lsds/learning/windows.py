"""Causal windows: the last frames of named signals, offline over a dataset and online frame by frame, the same.

A frame in which a signal is undefined (the first, one with most markers lost) enters no window, and nothing is said
of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from struct import Struct
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.learning.datasets import Dataset


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


class Window:
    """The same online: `frames` (1, length, F) float32 is one array, the same for good, so that it can be bound."""

    def __init__(self, length: int, width: int) -> None:
        self.frames = np.zeros((1, length, width), np.float32)
        # Packed and moved as bytes: a quarter of what array operations on so few numbers take.
        self._bytes = self.frames.reshape(-1).data.cast("B")
        self._row = Struct(f"={width}f")
        self._starts = range(0, length * self._row.size, self._row.size)
        self._empty = True

    def reset(self) -> None:
        """Forget all frames."""
        self._empty = True

    def push(self, values: Sequence[float]) -> None:
        """Take a frame's values (F,), all finite; a frame with others must not come here (see `Picker`)."""
        if self._empty:
            for start in self._starts:
                self._row.pack_into(self._bytes, start, *values)
            self._empty = False
            return
        size = self._row.size
        # Overlapping stretches are copied as if they were apart.
        self._bytes[:-size] = self._bytes[size:]
        self._row.pack_into(self._bytes, self._starts[-1], *values)
