"""One frame's way from image to observation: track -> field -> contact -> features.

The same object serves the running cell and a recording, frame by frame; there is no other way through, so offline
and online numbers are the same numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.contracts import Observation
from lsds.errors import DataError
from lsds.tactile.depth import DepthEstimator
from lsds.tactile.features import FeatureExtractor
from lsds.tactile.field import FieldBuilder
from lsds.tactile.reference import average_frames

if TYPE_CHECKING:
    from lsds.contracts import Frame, MarkerReference, MarkerTracks, SensorSpec, Tracker
    from lsds.tactile.options import TactileOptions


class Perception:
    """State from frame to frame: the tracker's, the last field's and the last features'."""

    def __init__(self, tracker: Tracker, spec: SensorSpec, options: TactileOptions) -> None:
        # These images are too small to share: waking OpenCV's threads costs several times what they save.
        cv2.setNumThreads(1)
        self._tracker = tracker
        self._spec = spec
        self._options = options
        self.metres_per_px = spec.metres_per_px if options.mm_per_px is None else options.mm_per_px * 1e-3
        self._features = FeatureExtractor()
        self.reference: MarkerReference | None = None
        self.reference_frame: Frame | None = None

    def start(self, frames: Sequence[Frame]) -> MarkerReference:
        """Take the untouched gel from one or more frames. Raises DataError where they show no usable reference."""
        for frame in frames:
            check_frame(frame, self._spec)
        self.reference_frame = average_frames(frames)
        self.reference = self._tracker.start(self.reference_frame, self._spec.pad)
        self._field = FieldBuilder(self.reference, self.metres_per_px)
        self._depth = DepthEstimator(
            self.reference_frame,
            self.metres_per_px,
            scale=self._options.depth_scale,
            threshold_m=self._options.contact_threshold_mm * 1e-3,
        )
        self._features.start(self.reference, self._field.position_m)
        return self.reference

    def reset(self) -> None:
        """Forget motion, keep the reference."""
        self._tracker.reset()
        self._field.reset()
        self._features.reset()

    def observe(self, frame: Frame) -> tuple[Observation, MarkerTracks]:
        """Return the observation of the next frame, and the tracks it rests on. Raises DataError for a bad frame."""
        check_frame(frame, self._spec)
        tracks = self._tracker.update(frame)
        field = self._field.build(tracks)
        contact = self._depth.measure(frame)
        features = self._features.extract(field, contact)
        return Observation(frame.t_ns, frame.seq, field.dt_s, field, contact, features), tracks


#: A frame of which more than this share is saturated, or that is black, shows nothing that could be measured.
UNUSABLE_SHARE = 0.5
BLACK_SHARE = 0.95
_DARK, _BRIGHT = 8, 247


def check_frame(frame: Frame, spec: SensorSpec) -> None:
    """Raise DataError where the image is not uint8 RGB of the sensor's size, or is mostly saturated or black.

    The message names the frame and the remedy.
    """
    image = frame.image
    expected = (spec.height_px, spec.width_px, 3)
    if not isinstance(image, np.ndarray) or image.dtype != np.uint8 or image.shape != expected:
        what = f"{image.dtype} {image.shape}" if isinstance(image, np.ndarray) else type(image).__name__
        broken = isinstance(image, np.ndarray) and image.dtype.kind == "f" and bool(np.isnan(image).any())
        what += " with NaN in it" if broken else ""
        raise DataError(
            f"frame {frame.seq}: expected a uint8 RGB image {expected}, got {what} "
            "(convert to 8-bit RGB and resize to the sensor's size)"
        )
    # Red and blue carry the dots, all three the contact: half of any of them gone is too much. The sum over all three
    # settles it for nearly every frame.
    sample = image[4::8, 4::8].reshape(-1, 3)
    bright = sample >= _BRIGHT
    limit = UNUSABLE_SHARE * len(sample)
    if np.count_nonzero(bright) > limit and bright.sum(axis=0).max() > limit:
        raise DataError(f"frame {frame.seq}: most of the image is saturated (lower the exposure, shield the gel)")
    # Without red and blue there are no dots, however green the image.
    if np.count_nonzero(sample[:, ::2] <= _DARK) > BLACK_SHARE * 2 * len(sample):
        raise DataError(f"frame {frame.seq}: the image is black (is the sensor lit? was the frame torn?)")
