"""Refines rough positions of dots: Lucas-Kanade against the reference image, or a weighted centroid.

Both measure each frame against the reference, not against the frame before, so errors do not add up over time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import cv2
import numpy as np

from lsds_plugins.trackers.dotted.cut_dots import CutDots

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Localiser(Protocol):
    """Refines rough dot positions to sub-pixel ones.

    `visible` is the share of a dot's diameter by which its centre must lie inside the image to be measured.
    """

    visible: float

    def start(self, grey: NDArray[np.uint8], xy_px: NDArray[np.float64], diameter_px: float) -> NDArray[np.float64]:
        """Take the reference image and its dots (N, 2); return their refined positions."""
        ...

    def refine(self, grey: NDArray[np.uint8], rough_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return refined positions (N, 2), NaN for those that cannot be refined."""
        ...


class LucasKanade:
    """Optical flow of a window around each dot, from the reference image to this one (Lucas and Kanade, 1981)."""

    #: Nine tenths of a dot's diameter: its edge crosses the window's corners. A window around the whole dot costs twice
    #: as much and gains a thousandth of a pixel.
    _LARGEST_WINDOW = 21
    #: Dots cut by the border are matched on what is left of them, down to about two thirds.
    visible = 0.3

    def start(self, grey: NDArray[np.uint8], xy_px: NDArray[np.float64], diameter_px: float) -> NDArray[np.float64]:
        """Take the reference. Its dots are centred by the weighted centroid: flow knows differences only."""
        xy = Centroid().start(grey, xy_px, diameter_px)
        window = min(self._LARGEST_WINDOW, max(9, int(0.9 * diameter_px) | 1))
        self._window = (window, window)
        self._grey = grey
        self._points = xy.astype(np.float32).reshape(-1, 1, 2)
        self._cut = CutDots(grey, xy, diameter_px)
        return xy

    def refine(self, grey: NDArray[np.uint8], rough_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """Follow each window from its rough position."""
        guess = rough_px.astype(np.float32).reshape(-1, 1, 2)
        found, status, _ = cv2.calcOpticalFlowPyrLK(
            self._grey,
            grey,
            self._points,
            guess,
            winSize=self._window,
            maxLevel=0,
            criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.01),
            # The eigenvalue is known anyway; the error that it stands in for would cost a pass over every window.
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW | cv2.OPTFLOW_LK_GET_MIN_EIGENVALS,
            minEigThreshold=1e-4,
        )
        xy = found.reshape(-1, 2).astype(np.float64)
        xy[status.ravel() == 0] = np.nan
        self._cut.refine(grey, xy)
        return xy


class Centroid:
    """Centre of darkness in a disk around each dot, twice: the second disk sits on the first result."""

    #: The centre of darkness of a cut dot is not its centre.
    visible = 0.55

    def start(self, grey: NDArray[np.uint8], xy_px: NDArray[np.float64], diameter_px: float) -> NDArray[np.float64]:
        """Take the reference dots."""
        radius = max(5, int(diameter_px / 2 + 3))
        dy, dx = np.mgrid[-radius : radius + 1, -radius : radius + 1]
        inside = dx**2 + dy**2 <= (radius + 0.3) ** 2
        self._radius = radius
        self._dx, self._dy = dx[inside], dy[inside]
        self._basis = np.stack([np.ones(len(self._dx)), self._dx, self._dy], axis=1).astype(np.float32)
        self._rank = int(0.8 * len(self._dx))
        height, width = grey.shape
        self._offset = self._dy * width + self._dx
        self._low = np.array([radius, radius])
        self._high = np.array([width - 1 - radius, height - 1 - radius])
        return self.refine(grey, xy_px)

    def refine(self, grey: NDArray[np.uint8], rough_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return centres; the background level is the 80th percentile of each disk, so it may be shaded."""
        flat, width = grey.ravel(), grey.shape[1]
        xy = rough_px
        for _ in range(2):
            lost = np.asarray(~np.isfinite(xy).all(axis=1))
            middle = np.rint(np.where(lost[:, None], 0.0, xy)).astype(np.intp)
            # A dot at the border is measured in a window pushed inwards; its own disk no longer fits.
            middle = np.clip(middle, self._low, self._high)
            window = flat[(middle[:, 1] * width + middle[:, 0])[:, None] + self._offset]
            level = np.partition(window, self._rank, axis=1)[:, self._rank].astype(np.float32) * 0.85
            dark = level[:, None] - window
            np.maximum(dark, 0.0, out=dark)
            moment = dark @ self._basis
            mass = moment[:, 0]
            lost |= mass <= 0
            xy = middle + moment[:, 1:] / np.where(mass > 0, mass, 1.0)[:, None]
            xy[lost] = np.nan
        return np.asarray(xy, np.float64)
