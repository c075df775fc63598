"""Causal windows: the last frames of named signals, offline over a dataset and online frame by frame, the same.

A frame in which a signal is undefined (the first, one with most markers lost) enters no window, and nothing is said
of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
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
    """The same online: a ring that is written twice, so that the window is always one stretch of memory."""

    def __init__(self, length: int, width: int) -> None:
        self._length = length
        self._ring = np.zeros((2 * length, width), np.float32)
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._next = 0
        self._empty = True

    def push(self, values: NDArray[np.float32]) -> NDArray[np.float32] | None:
        """Take a frame's values (F,); return the window (1, length, F) of last frames, None for an unusable frame.

        It is overwritten by the next push.
        """
        if not np.isfinite(values).all():
            return None
        if self._empty:
            self._ring[:] = values
            self._empty = False
        at, length = self._next, self._length
        self._ring[at] = self._ring[at + length] = values
        self._next = (at + 1) % length
        return self._ring[None, at + 1 : at + 1 + length]
