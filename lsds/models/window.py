"""The window of past frames: the input of a running model.

A frame with an undefined signal (the first frame, or one with most markers lost) is not added to the window and gets no
prediction.
"""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct

import numpy as np


class Window:
    """Causal window: `frames` (1, length, F) float32 is always the same array, so that it can be bound."""

    def __init__(self, length: int, width: int) -> None:
        self.frames = np.zeros((1, length, width), np.float32)
        # Packed and moved as bytes, which takes a quarter of the time of array operations on so few numbers.
        self._bytes = self.frames.reshape(-1).data.cast("B")
        self._row = Struct(f"={width}f")
        self._starts = range(0, length * self._row.size, self._row.size)
        self._empty = True

    def reset(self) -> None:
        """Clear all frames."""
        self._empty = True

    def push(self, values: Sequence[float]) -> None:
        """Add a frame's values (F,), which must all be finite (see `Picker`)."""
        if self._empty:
            for start in self._starts:
                self._row.pack_into(self._bytes, start, *values)
            self._empty = False
            return
        size = self._row.size
        # Overlapping ranges are copied correctly.
        self._bytes[:-size] = self._bytes[size:]
        self._row.pack_into(self._bytes, self._starts[-1], *values)
