"""Common tracker designs, for comparison with ours: neither flags its own errors."""

from __future__ import annotations

import cv2
import numpy as np
from lsds_plugins.trackers.dotted.pad import find_reference
from numpy.typing import NDArray

from lsds.contracts import Frame, MarkerReference, MarkerTracks, TrackFlag
from lsds.tactile.views import ViewedFrame


class BlobNearest:
    """OpenCV's SimpleBlobDetector in every frame, each marker takes the blob nearest to its last position."""

    def __init__(self) -> None:
        parameters = cv2.SimpleBlobDetector.Params()
        parameters.minThreshold, parameters.maxThreshold, parameters.thresholdStep = 20, 110, 15
        parameters.filterByArea, parameters.minArea, parameters.maxArea = True, 40, 400
        parameters.filterByCircularity = parameters.filterByConvexity = parameters.filterByInertia = False
        self._detector = cv2.SimpleBlobDetector.create(parameters)

    def start(self, frame: Frame, pad: tuple[int, int] | None = None) -> MarkerReference:
        """Take the reference."""
        self._reference = find_reference(ViewedFrame(frame)).reference
        self._xy = self._reference.xy_px.copy()
        return self._reference

    def update(self, frame: Frame) -> MarkerTracks:
        """Detect and match."""
        grey = np.asarray(cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY), np.uint8)
        blobs = np.array([point.pt for point in self._detector.detect(grey)]).reshape(-1, 2)
        if len(blobs):
            offset = blobs[None, :, :] - self._xy[:, None, :]
            self._xy = blobs[np.einsum("nmk,nmk->nm", offset, offset).argmin(axis=1)]
        return _all_valid(frame, self._xy)


class PyramidFlow:
    """Pyramidal Lucas-Kanade from the last frame to this one, with its status flags as the only check."""

    def start(self, frame: Frame, pad: tuple[int, int] | None = None) -> MarkerReference:
        """Take the reference."""
        reference = find_reference(ViewedFrame(frame)).reference
        self._grey = np.asarray(cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY), np.uint8)
        self._xy = reference.xy_px.astype(np.float32).reshape(-1, 1, 2)
        return reference

    def update(self, frame: Frame) -> MarkerTracks:
        """Follow."""
        grey = np.asarray(cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY), np.uint8)
        moved, status, _ = cv2.calcOpticalFlowPyrLK(
            self._grey, grey, self._xy, np.empty_like(self._xy), winSize=(21, 21), maxLevel=3
        )
        self._grey, self._xy = grey, np.asarray(moved, np.float32)
        xy = self._xy.reshape(-1, 2).astype(np.float64)
        valid = status.ravel() == 1
        xy[~valid] = np.nan
        flags = np.where(valid, TrackFlag.OK.value, TrackFlag.LOST.value).astype(np.uint8)
        return MarkerTracks(frame.t_ns, frame.seq, xy, valid, flags)


def _all_valid(frame: Frame, xy: NDArray[np.float64]) -> MarkerTracks:
    count = len(xy)
    return MarkerTracks(frame.t_ns, frame.seq, xy.copy(), np.ones(count, bool), np.zeros(count, np.uint8))
