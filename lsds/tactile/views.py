"""The views of one tactile image that several steps need, each computed once and only when asked for.

Perception gives the tracker a `ViewedFrame`: a frame that carries its views along. Tracker, depth and whoever comes
later find the work done, and a tracker that knows nothing of views still gets a frame.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.contracts import Frame

if TYPE_CHECKING:
    from numpy.typing import NDArray

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


class ViewedFrame(Frame):
    """A frame in grey and at half resolution. `image` is uint8 (height, width, 3) RGB.

    `planes` is room for the image's three colours; it is written over and may be shared by frames of one stream.
    """

    def __init__(self, frame: Frame, planes: list[NDArray[np.uint8]] | None = None) -> None:
        super().__init__(frame.image, frame.t_ns, frame.seq, frame.redrawn)
        self.__dict__["_planes"] = planes  # Frames are frozen.

    @cached_property
    def grey(self) -> NDArray[np.uint8]:
        """Brightness of the dots without the colours of the contact, uint8 (height, width): see `RED_SHARE`."""
        planes: list[NDArray[np.uint8]] | None = self.__dict__["_planes"]
        red, _, blue = cv2.split(self.image) if planes is None else cv2.split(self.image, planes)
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
        height, width = self.image.shape[:2]
        return np.asarray(
            cv2.resize(self.image, (width // HALF, height // HALF), interpolation=cv2.INTER_AREA), np.uint8
        )

    @cached_property
    def dark(self) -> NDArray[np.uint8]:
        """Dots' mask at half resolution: 255 where darker than the surroundings, else 0.

        The threshold is a ratio to the local mean, so the dim start-up frames, the uneven lighting and the colours
        of a contact change nothing.
        """
        grey = self.half_grey
        mean = surroundings(grey)
        cv2.convertScaleAbs(mean, mean, DARKNESS)
        return np.asarray(cv2.compare(grey, mean, cv2.CMP_LT), np.uint8)


def surroundings(half_grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the mean around each pixel (h, w) of a grey image at half resolution."""
    return np.asarray(cv2.blur(half_grey, (MEAN_WINDOW, MEAN_WINDOW), borderType=cv2.BORDER_REFLECT), np.uint8)


def smaller(xy_px: NDArray[np.float64], scale: float) -> NDArray[np.float64]:
    """Return positions (n, 2) of the image in pixels of a view, each `scale` px wide: pixels' corners coincide."""
    return np.asarray((xy_px + 0.5) / scale - 0.5)


class Viewer:
    """Gives the frames of one stream their views. The room for their colours is kept: new memory costs more than the
    split."""

    def __init__(self) -> None:
        self._planes: list[NDArray[np.uint8]] = []

    def view(self, frame: Frame) -> ViewedFrame:
        """Return the frame with its views, none computed yet."""
        size = frame.image.shape[:2]
        if not self._planes or self._planes[0].shape != size:
            self._planes = [np.empty(size, np.uint8) for _ in range(3)]
        return ViewedFrame(frame, self._planes)


def viewed(frame: Frame) -> ViewedFrame:
    """Return the frame with its views: itself where it has them already."""
    return frame if isinstance(frame, ViewedFrame) else ViewedFrame(frame)
