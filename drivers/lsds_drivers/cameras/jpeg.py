"""JPEG from cameras: end of the image, size, and check for completeness."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.errors import DataError
from lsds_drivers.cameras.source import Reduction

if TYPE_CHECKING:
    from numpy.typing import NDArray

START = b"\xff\xd8"
END = b"\xff\xd9"
_FLAGS = {
    1: cv2.IMREAD_COLOR,
    2: cv2.IMREAD_REDUCED_COLOR_2,
    4: cv2.IMREAD_REDUCED_COLOR_4,
    8: cv2.IMREAD_REDUCED_COLOR_8,
}
_SIZES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_ALONE = frozenset((0x01, *range(0xD0, 0xD8)))


def decode(jpeg: bytes, reduction: Reduction) -> NDArray[np.uint8]:
    """Return the picture as uint8 RGB, reduced as far as `reduction` allows. Raises DataError if it is damaged."""
    if not jpeg.startswith(START):
        raise DataError("the frame is not a JPEG (damaged on the way)")
    if END not in jpeg[-64:]:  # some cameras pad behind the end
        raise DataError("the frame has no end (cut short on the way)")
    factor = reduction(*size(jpeg))
    try:
        image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), _FLAGS[factor])
    except cv2.error as error:
        raise DataError(f"the frame cannot be decoded ({str(error).strip().splitlines()[-1]})") from error
    if image is None:
        raise DataError("the frame cannot be decoded (damaged on the way)")
    picture = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)
    require_whole(picture)
    return picture


def require_whole(image: NDArray[np.uint8]) -> None:
    """Raise DataError if the lowest row is one flat colour.

    A decoder fills missing data with its last colour; a real camera's noise is never flat.
    """
    row = image[-1]
    if image.shape[1] > 1 and bool((row == row[0]).all()):
        black = not image[-1].any() and not image[0].any()
        raise DataError("the frame is black" if black else "the frame is torn: its lower part did not arrive")


def size(jpeg: bytes) -> tuple[int, int]:
    """Return (width, height) from the header. Raises DataError if it has no size."""
    for marker, at, length in _segments(jpeg):
        if marker in _SIZES and length >= 7:
            return int.from_bytes(jpeg[at + 5 : at + 7]), int.from_bytes(jpeg[at + 3 : at + 5])
    raise DataError("the frame's header is damaged")


def end_of(data: bytes | bytearray, begin: int = 0) -> int | None:
    """Return the end of the JPEG that begins at `begin`; None if the end has not arrived yet.

    It parses the headers, because their tables may contain the end marker's bytes. Raises DataError without a JPEG.
    """
    if len(data) < begin + 2:
        return None
    if data[begin : begin + 2] != START:
        raise DataError("the stream is out of step: no JPEG begins here")
    at = begin + 2
    for marker, segment, length in _segments(data, begin):
        if marker == 0xDA:
            found = data.find(END, segment + length)
            return None if found < 0 else found + 2
        at = segment + length
    if at < len(data) and data[at] != 0xFF:
        raise DataError("the frame's header is damaged")
    return None


def _segments(data: bytes | bytearray, begin: int = 0) -> list[tuple[int, int, int]]:
    """Return the complete segments of the header: (marker, position of its length field, length with that field)."""
    found = []
    at = begin + 2
    while at + 4 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker == 0xFF or marker in _ALONE:
            at += 1 if marker == 0xFF else 2
            continue
        length = int.from_bytes(data[at + 2 : at + 4])
        if length < 2 or at + 2 + length > len(data):
            break
        found.append((marker, at + 2, length))
        if marker == 0xDA:
            break
        at += 2 + length
    return found
