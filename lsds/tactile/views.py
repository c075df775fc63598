"""Views of one tactile image that several steps share, each computed once, on first use.

Perception passes a `ViewedFrame` on: a frame with its views. Tracker, depth and later steps share the results, and a
tracker that does not know views uses it as a plain frame.
"""

from __future__ import annotations

import weakref
from functools import cached_property
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.contracts import Frame

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Share of red in the grey image that markers are measured in; the rest is blue. A slope of the surface changes R, G, B
#: by (-14, 84, 11) and (-88, 9, 62) levels per unit along x and y (GelSight Mini calibration). This mix cancels both:
#: the light's edge around a contact would otherwise shift the markers on it by 0.15 px.
RED_SHARE = 0.41
#: Factor of the smaller views, for steps without sub-pixel accuracy (finding markers, light, depth).
HALF = 2
#: Share of the local mean below which a pixel belongs to a marker.
DARKNESS = 0.72
#: Window of the local mean, px of the half-size image: about half a pitch, so that it always contains background.
MEAN_WINDOW = 17


class ColourPlanes:
    """The three colours of one frame at a time; their buffers are reused.

    Allocating them takes longer than splitting an image.
    """

    def __init__(self) -> None:
        self._buffers: list[NDArray[np.uint8]] = []
        # A plain reference would be a circle, and full garbage collections are suspended while a cell runs.
        self._of: weakref.ref[ViewedFrame] | None = None

    def of(self, frame: ViewedFrame) -> list[NDArray[np.uint8]]:
        """Return the red, green and blue (height, width) of a frame, valid until another frame is asked for."""
        if self._of is None or self._of() is not frame:
            size = frame.image.shape[:2]
            if not self._buffers or self._buffers[0].shape != size:
                self._buffers = [np.empty(size, np.uint8) for _ in range(3)]
            cv2.split(frame.image, self._buffers)
            self._of = weakref.ref(frame)
        return self._buffers


class ViewedFrame(Frame):
    """A frame in grey and at half resolution. `image` is uint8 (height, width, 3) RGB.

    The frames of a stream may share their `planes`.
    """

    def __init__(self, frame: Frame, planes: ColourPlanes | None = None) -> None:
        super().__init__(frame.image, frame.t_ns, frame.seq, frame.redrawn)
        self.__dict__["_planes"] = planes or ColourPlanes()  # Frames are frozen.

    @cached_property
    def grey(self) -> NDArray[np.uint8]:
        """Grey image of the markers without the colours of the contact, uint8 (height, width): see `RED_SHARE`."""
        red, _, blue = self._colours
        return np.asarray(cv2.addWeighted(red, RED_SHARE, blue, 1 - RED_SHARE, 0), np.uint8)

    @property
    def _colours(self) -> list[NDArray[np.uint8]]:
        planes: ColourPlanes = self.__dict__["_planes"]
        return planes.of(self)

    @cached_property
    def half_planes(self) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]:
        """`half_rgb` as three planes, each uint8 (height / 2, width / 2)."""
        height, width = self.image.shape[:2]
        size = (width // HALF, height // HALF)
        red, green, blue = (cv2.resize(plane, size, interpolation=cv2.INTER_AREA) for plane in self._colours)
        return np.asarray(red, np.uint8), np.asarray(green, np.uint8), np.asarray(blue, np.uint8)

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
        """Mask of the markers at half resolution: 255 if darker than the surroundings, else 0.

        The threshold is relative to the local mean, so it does not depend on dim start-up frames, uneven lighting or
        the colours of a contact.
        """
        grey = self.half_grey
        mean = surroundings(grey)
        cv2.convertScaleAbs(mean, mean, DARKNESS)
        return np.asarray(cv2.compare(grey, mean, cv2.CMP_LT), np.uint8)


def surroundings(half_grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the mean around each pixel (h, w) of a grey image at half resolution."""
    return np.asarray(cv2.blur(half_grey, (MEAN_WINDOW, MEAN_WINDOW), borderType=cv2.BORDER_REFLECT), np.uint8)


def smaller(xy_px: NDArray[np.float64], scale: float) -> NDArray[np.float64]:
    """Return image positions (n, 2) in pixels of a view, each `scale` px wide; the corners of the pixels coincide."""
    return np.asarray((xy_px + 0.5) / scale - 0.5)


class Viewer:
    """Adds views to the frames of one stream."""

    def __init__(self) -> None:
        self._planes = ColourPlanes()

    def view(self, frame: Frame) -> ViewedFrame:
        """Return the frame with its views, not yet computed."""
        return ViewedFrame(frame, self._planes)


def viewed(frame: Frame) -> ViewedFrame:
    """Return the frame with its views: the same object if it already has them."""
    return frame if isinstance(frame, ViewedFrame) else ViewedFrame(frame)
