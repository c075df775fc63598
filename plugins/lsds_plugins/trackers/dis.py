"""Tracker `dis`: dense optical flow (Kroeger et al. 2016) sampled on a grid of points, for gels without dots.

Flow runs from the reference image to each frame at half resolution, started from the last frame's flow, so errors do
not add up and travel larger than the search radius is followed step by step. A point counts as seen where the
reference has texture there and where the frame, warped back, looks like the reference.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext, Frame, MarkerReference, MarkerTracks, TrackFlag
from lsds.errors import DataError
from lsds.tactile.views import HALF, viewed

#: Width of the window over which mismatch, flow and texture are averaged, px; chosen.
_PATCH = 9
#: Below this OpenCV finds no scale to begin at: its patches of 8 px have to fit the halved image.
_LEAST_FLOW_PX = 24
#: Texture may fade to this share of the least that a reference needs before it counts as gone.
FADED = 0.5


class DenseFlowOptions(BaseModel):
    """Options of `[tracker.dis]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    rows: int = Field(default=7, ge=3, le=60, description="rows of sample points")
    columns: int = Field(default=9, ge=3, le=80, description="columns of sample points")
    margin_px: float = Field(
        default=20, ge=0, le=100, description="distance of the outer sample points from the border"
    )
    least_contrast: float = Field(
        default=1.0, ge=0, le=255, description="minimum grey-level deviation around a point for tracking it"
    )
    most_mismatch: float = Field(
        default=12.0, gt=0, le=255, description="mean grey-level difference above which a point counts as lost"
    )


class DenseFlowTracker:
    """A `Tracker` whose markers are sample points of the dense flow."""

    def __init__(self, options: DenseFlowOptions, context: BuildContext) -> None:
        self._options = options
        self._flow_of = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
        self._reference: MarkerReference | None = None

    def start(self, frame: Frame, pad: tuple[int, int] | None = None) -> MarkerReference:
        """Lay the grid of sample points over the untouched frame. Raises DataError if nothing has texture."""
        options = self._options
        height, width = frame.image.shape[:2]
        if min(width, height) < _LEAST_FLOW_PX:
            raise DataError(
                f"reference frame {frame.seq}: {width} x {height} pixels are too few for dense flow, which takes "
                f"{_LEAST_FLOW_PX} each way (use larger images)"
            )
        if 2 * options.margin_px >= min(width, height) - 1:
            raise DataError(
                f"reference frame {frame.seq}: {width} x {height} pixels leave no room for sample points "
                f"{options.margin_px:g} px from the border (lower tracker.dis.margin_px, or use larger images)"
            )
        x = np.linspace(options.margin_px, width - 1 - options.margin_px, options.columns)
        y = np.linspace(options.margin_px, height - 1 - options.margin_px, options.rows)
        grid_x, grid_y = np.meshgrid(x, y)
        xy = np.stack([grid_x.ravel(), grid_y.ravel()], axis=1)
        row, column = np.divmod(np.arange(len(xy)), options.columns)
        self._grey = viewed(frame).half_grey
        # A point on the far border rounds to a pixel beyond the halved image.
        last = np.array(self._grey.shape[::-1]) - 1
        self._pixel = np.minimum(np.rint(xy / HALF), last).astype(np.intp)
        self._seen = self._contrast(self._grey) >= options.least_contrast
        if np.count_nonzero(self._seen) < 4:
            raise DataError(
                f"reference frame {frame.seq}: {np.count_nonzero(self._seen)} of {len(xy)} sample points have any "
                "texture to follow (is the sensor lit and in focus? lower tracker.dis.least_contrast to go on)"
            )
        pitch = (float(x[1] - x[0]), float(y[1] - y[0]))
        self._reference = MarkerReference(
            xy, np.stack([row, column], axis=1), (options.rows, options.columns), pitch, np.eye(2), (width, height)
        )
        self._at_x, self._at_y = np.meshgrid(
            np.arange(self._grey.shape[1], dtype=np.float32), np.arange(self._grey.shape[0], dtype=np.float32)
        )
        self.reset()
        return self._reference

    def reset(self) -> None:
        """Forget motion, keep the reference."""
        self._flow: NDArray[np.float32] | None = None

    def update(self, frame: Frame) -> MarkerTracks:
        """Follow the sample points into the next frame."""
        if self._reference is None:
            raise RuntimeError("start() has to see the undeformed frame before update()")
        grey = viewed(frame).half_grey
        start = np.zeros((*grey.shape, 2), np.float32) if self._flow is None else self._flow
        flow = np.asarray(self._flow_of.calc(self._grey, grey, start.copy()), np.float32)
        self._flow = flow
        warped = cv2.remap(
            grey,
            self._at_x + flow[..., 0],
            self._at_y + flow[..., 1],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        # A change of brightness common to both is no mismatch.
        mismatch = cv2.absdiff(warped, self._grey).astype(np.float32)
        mismatch = np.abs(mismatch - np.median(mismatch[::4, ::4]))
        column, row = self._pixel.T
        at_point = cv2.blur(mismatch, (_PATCH, _PATCH))[row, column]
        smooth = cv2.blur(flow, (_PATCH, _PATCH))
        xy = self._reference.xy_px + smooth[row, column].astype(np.float64) * HALF
        width, height = self._reference.image_size
        inside = ((xy >= 0) & (xy <= [width - 1, height - 1])).all(axis=1)
        flags = np.full(len(xy), TrackFlag.OK.value, np.uint8)
        flags[at_point > self._options.most_mismatch] = TrackFlag.INCONSISTENT.value
        # Black and saturated frames differ from the reference by a level common to all, too; what they lack is texture.
        flags[~self._seen | (self._contrast(np.asarray(warped, np.uint8)) < FADED * self._options.least_contrast)] = (
            TrackFlag.LOST.value
        )
        flags[~inside] = TrackFlag.OUT_OF_VIEW.value
        valid = flags == TrackFlag.OK.value
        xy[~valid] = np.nan
        return MarkerTracks(frame.t_ns, frame.seq, xy, valid, flags)

    def _contrast(self, grey: NDArray[np.uint8]) -> NDArray[np.float64]:
        """Standard deviation of the grey levels around each sample point."""
        level = grey.astype(np.float32)
        mean = cv2.blur(level, (_PATCH, _PATCH))
        square = cv2.blur(level * level, (_PATCH, _PATCH))
        column, row = self._pixel.T
        return np.asarray(np.sqrt(np.maximum(square - mean * mean, 0.0))[row, column], np.float64)
