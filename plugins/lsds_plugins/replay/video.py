"""Sensor `video`: a recording played as if it were a camera."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from lsds.clock import nanoseconds
from lsds.contracts import BuildContext, Frame, SensorSpec
from lsds.errors import DataError
from lsds_plugins.replay.played import PlayedSensor
from lsds_plugins.replay.reader import Picture, Reader, open_reader
from lsds_plugins.replay.times import FrameTimes, Timestamps, read_times

_Count = Annotated[int, Field(strict=True, ge=1, le=10_000)]


MINI_PX = (320, 240)
"""Size of a GelSight Mini's images, px."""
LONGER_SIDE_M = 20e-3
"""Length on the longer side of a GelSight Mini's image, m: 320 px of 62.5 um; published values are 18.6 to 22.7 mm."""


DARK_LEVEL = 8
"""Brightest level of an image that counts as black: compressed black is seldom exactly 0; chosen."""


class VideoOptions(BaseModel):
    """Options of `[sensor.video]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    path: str = Field(default="", description="video file, folder of images, or glob pattern such as clip/*.png")
    timestamps: Timestamps = Field(
        default="nominal", description="nominal: every 1/rate_hz; file: as stored in the video; list: times_file"
    )
    times_file: str = Field(default="", description="text file with one time in seconds per frame, for 'list'")
    rate_hz: float = Field(
        default=0.0, ge=0, le=1000, description="nominal rate; 0: that of the file if it has one, else 25"
    )
    mm_per_px: float = Field(
        default=0.0, ge=0, le=1, description="scale of the image; 0: its longer side shows 20 mm, as of a GelSight Mini"
    )
    # A TOML array is a list, which strict tuples refuse.
    size: tuple[_Count, _Count] | None = Field(
        default=None, strict=False, description="resize to [width, height]; default: do not resize"
    )
    pad: tuple[_Count, _Count] | None = Field(
        default=None, strict=False, description="printed markers, [rows, columns], if known"
    )
    grey: bool = Field(
        default=False, description="accept a recording without colour, for which the contact area is meaningless"
    )

    @model_validator(mode="after")
    def _times_need_a_file(self) -> VideoOptions:
        if (self.timestamps == "list") != bool(self.times_file):
            raise ValueError("timestamps = 'list' and times_file go together")
        return self


class VideoSensor(PlayedSensor):
    """A `TactileSensor` that shows the images of a video, a folder or a pattern."""

    def __init__(self, options: VideoOptions, context: BuildContext) -> None:
        super().__init__("video", options.path, context.clock)
        self._options = options
        self._spec: SensorSpec | None = None

    @property
    def spec(self) -> SensorSpec:
        """Size of the frames, nominal rate and scale. Opens the recording briefly if it is not connected."""
        if self._spec is None:
            image = next(self._images(self._open())).image
            height, width = image.shape[:2]
            rate = self._options.rate_hz or self._reader_rate or 25.0
            metres_per_px = self._options.mm_per_px * 1e-3 or LONGER_SIDE_M / max(width, height)
            self._spec = SensorSpec(width, height, rate, metres_per_px, self._options.pad)
        return self._spec

    @property
    def notes(self) -> list[str]:
        """Doubts about the recording: its scale is assumed, or images are missing."""
        spec, notes = self.spec, []
        if not self._options.mm_per_px and (spec.width_px, spec.height_px) != MINI_PX:
            size = f"{spec.width_px} x {spec.height_px} px"
            notes.append(
                f"the scale of {size} is assumed, {1e3 * spec.metres_per_px:.3g} mm per px (set sensor.video.mm_per_px)"
            )
        if self._missing:
            notes.append(
                f"by the numbers in their names {self._missing} images are missing; their time is counted "
                "(rename the files if it was none)"
            )
        return notes

    @property
    def frame_count(self) -> int:
        """Number of frames that the recording states, 0 if it states none."""
        return self._open().count

    def frames(self, start_ns: int = 0) -> Generator[Frame, None, None]:
        """Yield every frame, for work that does not wait for a clock. Raises DataError naming file and frame."""
        options = self._options
        reader = self._open()
        listed = read_times(options.times_file) if options.times_file else None
        times = FrameTimes(options.path, options.timestamps, self.spec.rate_hz, listed)
        missing = 0
        for number, (image, file_s, redrawn, gap) in enumerate(self._images(reader)):
            missing += gap
            yield Frame(image, start_ns + nanoseconds(times.of(number, file_s, missing)), number, redrawn)

    def _open(self) -> Reader:
        if not self._options.path:
            raise DataError("video: no recording named (set sensor.video.path)")
        reader = open_reader(self._options.path)
        self._reader_rate = reader.nominal_hz if math.isfinite(reader.nominal_hz) else 0.0
        self._missing = reader.missing if self._options.timestamps == "nominal" else 0
        return reader

    def _images(self, reader: Reader) -> Iterator[Picture]:
        for number, picture in enumerate(reader.images()):
            image = picture.image
            if number == 0 and not self._options.grey and image.max() < DARK_LEVEL:
                raise DataError(f"{self._options.path}: frame 0 is black (cut off what precedes the first image)")
            if number == 0 and not self._options.grey and _is_grey(image):
                raise DataError(
                    f"{self._options.path}: frame 0 is grey, but contact is measured from colour "
                    "(record in colour, or set sensor.video.grey=true to use the dots alone)"
                )
            if self._options.size is not None and image.shape[1::-1] != self._options.size:
                image = np.asarray(cv2.resize(image, self._options.size, interpolation=cv2.INTER_AREA), np.uint8)
            yield picture._replace(image=image)


def _is_grey(image: NDArray[np.uint8]) -> bool:
    sample = image[::4, ::4].astype(np.int16)
    return bool(np.abs(sample - sample[..., :1]).max() <= 1)
