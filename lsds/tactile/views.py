"""The views of one tactile image that several steps need, each computed once and only when asked for.

Tracker and depth both need the halved image and the dots' mask; `views_of` lets whoever comes second find the work
done, without either knowing of the other.
"""

from __future__ import annotations

import threading
from functools import cached_property
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Frame

#: Red's share in the grey that dots are measured in; blue has the rest. A slope of the surface changes R, G, B by
#: (-14, 84, 11) and (-88, 9, 62) levels per unit along x and y (GelSight Mini calibration): this mix cancels both, so
#: the light's edge around a contact cannot pull at the dots that lie on it, which would cost 0.15 px.
RED_SHARE = 0.41
#: Views are halved once for everything that needs no sub-pixel accuracy (finding dots, light, depth).
HALF = 2


#: A pixel belongs to a dot where it is darker than this fraction of the mean around it.
DARKNESS = 0.72
#: Window of the local mean, px of the half-size image: about half a pitch, always with some background in it.
MEAN_WINDOW = 17


class FrameViews:
    """One frame in grey and at half resolution. `image` is uint8 (height, width, 3) RGB."""

    def __init__(self, frame: Frame) -> None:
        self.frame = frame

    @cached_property
    def grey(self) -> NDArray[np.uint8]:
        """Brightness of the dots without the colours of the contact, uint8 (height, width): see `RED_SHARE`."""
        red, _, blue = cv2.split(self.frame.image, _planes(self.frame.image))
        return np.asarray(cv2.addWeighted(red, RED_SHARE, blue, 1 - RED_SHARE, 0), np.uint8)

    @cached_property
    def half_grey(self) -> NDArray[np.uint8]:
        """`grey` at half resolution (area average), uint8 (height / 2, width / 2)."""
        height, width = self.grey.shape
        return np.asarray(
            cv2.resize(self.grey, (width // HALF, height // HALF), interpolation=cv2.INTER_AREA), np.uint8
        )

    @cached_property
    def half_rgb(self) -> NDArray[np.uint8]:
        """Colour at half resolution (area average), uint8 (height / 2, width / 2, 3)."""
        height, width = self.frame.image.shape[:2]
        return np.asarray(
            cv2.resize(self.frame.image, (width // HALF, height // HALF), interpolation=cv2.INTER_AREA), np.uint8
        )

    @cached_property
    def dark(self) -> NDArray[np.uint8]:
        """Dots' mask at half resolution: 255 where darker than the surroundings, else 0.

        The threshold is a ratio to the local mean, so the dim start-up frames, the uneven lighting and the colours
        of a contact change nothing.
        """
        grey = self.half_grey
        mean = cv2.blur(grey, (MEAN_WINDOW, MEAN_WINDOW), borderType=cv2.BORDER_REFLECT)
        cv2.convertScaleAbs(mean, mean, DARKNESS)
        return np.asarray(cv2.compare(grey, mean, cv2.CMP_LT), np.uint8)


class _Kept(threading.local):
    """What one thread keeps from frame to frame; another thread's frames must not get in between."""

    scratch: list[NDArray[np.uint8]]
    last: FrameViews | None = None

    def __init__(self) -> None:
        self.scratch = []


_kept = _Kept()


def _planes(image: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    """Return room for the three colours of an image; kept, as new memory costs more than the split."""
    scratch = _kept.scratch
    if not scratch or scratch[0].shape != image.shape[:2]:
        scratch = _kept.scratch = [np.empty(image.shape[:2], np.uint8) for _ in range(3)]
    return scratch


def views_of(frame: Frame) -> FrameViews:
    """Return the views of a frame; those of the last frame that this thread asked for are kept."""
    last = _kept.last
    if last is None or last.frame is not frame:
        last = _kept.last = FrameViews(frame)
    return last
