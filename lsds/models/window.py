"""The last frames of named signals, online: what a running model looks at.

A frame in which a signal is undefined (the first, one with most markers lost) enters no window, and nothing is said
of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct

import numpy as np


class Window:
    """Causal window: `frames` (1, length, F) float32 is one array, the same for good, so that it can be bound."""

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
