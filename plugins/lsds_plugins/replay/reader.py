"""Frames from a video file, a recorded run, a folder of images, or a glob pattern of image names."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from statistics import mode
from typing import NamedTuple, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from lsds.errors import CutOff, DataError
from lsds.session.recording import ENDING

IMAGE_ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")


class Picture(NamedTuple):
    """An image as read: uint8 (height, width, 3) RGB, seconds by the file (NaN if it has no times), whether it is a
    key frame after frames in which the codec stored only changes, and how many images are missing before it."""

    image: NDArray[np.uint8]
    time_s: float
    redrawn: bool = False
    missing: int = 0


class Reader(Protocol):
    """A source of images in order. `count` is the number stated by the source, 0 if unknown, and `missing` the number
    of images that it lacks in between."""

    count: int
    nominal_hz: float
    missing: int

    def images(self) -> Iterator[Picture]:
        """Yield the images. Raises DataError that names the file and the frame."""
        ...


def open_reader(path: str) -> Reader:
    """Return a reader for a video file, a recorded run, a folder of images, or a pattern `clip/*.png`.

    Raises DataError.
    """
    source = Path(path).expanduser()
    if source.is_dir():
        return ImageReader(path, [p for p in source.iterdir() if p.suffix.lower() in IMAGE_ENDINGS])
    if not source.exists() and any(letter in source.name for letter in "*?["):
        return ImageReader(path, list(source.parent.glob(source.name)))
    if not source.exists():
        raise DataError(f"{path}: no such file or folder; check the path")
    if source.stat().st_size == 0:
        raise DataError(f"{path}: the file is empty (was the recording or the copy interrupted?)")
    if source.suffix.lower() == ENDING:
        return RunReader(source)
    return VideoReader(source)


class RunReader:
    """The first finger of a recorded run; times are those of the exposures."""

    missing = 0

    def __init__(self, file: Path) -> None:
        from lsds.session.recording.reader import Recording

        self._recording = Recording(file)
        self.nominal_hz = self._recording.header.fingers[0].spec.rate_hz
        self.count = 0

    def images(self) -> Iterator[Picture]:
        """Yield the frames. Raises DataError at the end of a recording that is cut off."""
        first_ns: int | None = None
        for _, frame in self._recording.frames():
            first_ns = frame.t_ns if first_ns is None else first_ns
            yield Picture(frame.image, (frame.t_ns - first_ns) * 1e-9, frame.redrawn)
        if self._recording.damage:
            raise CutOff(f"{self._recording.path}: {self._recording.damage} (the earlier frames are valid)")


class ImageReader:
    """Images in the order of their names; there are no times in them. A gap in their numbers is a gap in time."""

    nominal_hz = 0.0

    def __init__(self, path: str, files: list[Path]) -> None:
        if not files:
            raise DataError(
                f"{path}: no images there (looked for {', '.join(IMAGE_ENDINGS)}; a folder of videos takes --batch)"
            )
        self._files = sorted(files, key=_natural)
        self._gaps = _gaps(self._files)
        self.count, self.missing = len(files), sum(self._gaps)

    def images(self) -> Iterator[Picture]:
        """Yield the images; a later one of another size is an error, as it cannot belong to the same recording."""
        shape: tuple[int, ...] | None = None
        for number, file in enumerate(self._files):
            image = cv2.imread(_text(file), cv2.IMREAD_COLOR)
            if image is None:
                raise DataError(f"{file}: frame {number} cannot be read as an image (damaged, or not an image)")
            if shape is not None and image.shape != shape:
                raise DataError(f"{file}: frame {number} is {_size(image.shape)}, those before it are {_size(shape)}")
            shape = image.shape
            yield Picture(_rgb(np.asarray(image, np.uint8)), math.nan, missing=self._gaps[number])


class VideoReader:
    """Any video that OpenCV's FFmpeg reads."""

    missing = 0

    def __init__(self, file: Path) -> None:
        self._file = file
        capture = self._open()
        self.nominal_hz = float(capture.get(cv2.CAP_PROP_FPS))
        self.count = max(0, int(capture.get(cv2.CAP_PROP_FRAME_COUNT)))
        capture.release()

    def images(self) -> Iterator[Picture]:
        """Yield the frames. Fewer frames than the header states mean a truncated or damaged file, which is reported at
        the end."""
        capture = self._open()
        number, changes_only = 0, False
        try:
            while True:
                good, image = capture.read()
                if not good:
                    break
                # Queried after the read, these are time and kind of the frame just read.
                whole = int(capture.get(cv2.CAP_PROP_FRAME_TYPE)) == ord("I")
                time_s = capture.get(cv2.CAP_PROP_POS_MSEC) * 1e-3
                yield Picture(_rgb(np.asarray(image, np.uint8)), time_s, whole and changes_only)
                number, changes_only = number + 1, not whole
        finally:
            capture.release()
        if number == 0:
            raise DataError(f"{self._file}: frame 0 cannot be decoded (empty, damaged, or an unknown codec)")
        if number < self.count:
            raise CutOff(
                f"{self._file}: frame {number} cannot be decoded, the header promises {self.count} "
                "(the file is truncated or damaged; the earlier frames are valid)"
            )

    def _open(self) -> cv2.VideoCapture:
        capture = cv2.VideoCapture(_text(self._file))
        if not capture.isOpened():
            raise DataError(f"{self._file}: not a video that can be opened (damaged header, or an unknown format)")
        return capture


def _text(file: Path) -> str:
    """Return a file's name for OpenCV, which would crash on bytes that are not UTF-8."""
    name = str(file)
    try:
        name.encode()
    except UnicodeEncodeError:
        shown = name.encode(errors="backslashreplace").decode()
        raise DataError(f"{shown}: the name is not UTF-8 text (rename the file)") from None
    return name


def _natural(file: Path) -> list[tuple[int, int | str]]:
    """Sort key by which frame2 comes before frame10."""
    # Digits that are no decimals, such as a raised two, are letters here.
    return [(0, int(part)) if part.isdecimal() else (1, part) for part in re.split(r"(\d+)", file.name)]


def _gaps(files: Sequence[Path]) -> list[int]:
    """Return how many images are missing before each, by the one number in which the names differ.

    Numbers that are no multiples of a step apart, as times are, show no gap.
    """
    names = [_natural(file) for file in files]
    differ = {
        at for name in names for at, (part, first) in enumerate(zip(name, names[0], strict=False)) if part != first
    }
    if len(differ) != 1 or len({len(name) for name in names}) > 1:
        return [0] * len(files)
    (at,) = differ
    numbers = [name[at][1] for name in names]
    apart = [
        after - before for before, after in pairwise(numbers) if isinstance(before, int) and isinstance(after, int)
    ]
    if len(apart) != len(files) - 1 or min(apart) < 1:
        return [0] * len(files)
    step = mode(apart)
    if any(each % step for each in apart):
        return [0] * len(files)
    return [0, *(each // step - 1 for each in apart)]


def _rgb(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]} x {shape[0]}"
