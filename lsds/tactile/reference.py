"""Reference image of the undeformed gel: the mean of several frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds.contracts import Frame
from lsds.errors import DataError

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Maximum relative change of brightness between frames of a settled stream.
SETTLED = 0.02


class ReferenceCollector:
    """Collects untouched frames until enough consecutive ones are equally bright.

    Cameras start dim and settle over the first frames. A reference from such frames would show a false contact over
    the whole gel.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._brightness = 0.0
        self.frames: list[Frame] = []

    def add(self, frame: Frame) -> bool:
        """Take a frame; return whether there are enough."""
        shown = brightness(frame)
        if abs(shown - self._brightness) > SETTLED * max(shown, 1.0):
            self.frames.clear()
        self._brightness = shown
        self.frames.append(frame)
        return len(self.frames) >= self._count


def brightness(frame: Frame) -> float:
    """Return the mean grey level."""
    return float(np.mean(frame.image[::4, ::4]))


def average_frames(frames: Sequence[Frame]) -> Frame:
    """Return the mean of untouched frames, with the last one's stamp: it has less noise than one frame.

    Raises DataError if there is no frame or if their sizes differ.
    """
    if not frames:
        raise DataError("reference: no frame to take it from (is the sensor streaming?)")
    shapes = {frame.image.shape for frame in frames}
    if len(shapes) > 1:
        raise DataError(f"reference: frames of different sizes {sorted(shapes)} cannot be averaged")
    total = np.zeros(frames[0].image.shape, np.float32)
    for frame in frames:
        total += frame.image
    mean = np.rint(total / len(frames)).astype(np.uint8)
    return Frame(mean, frames[-1].t_ns, frames[-1].seq)
