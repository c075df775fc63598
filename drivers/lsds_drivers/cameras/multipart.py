"""A parser for `multipart/x-mixed-replace`: parts with headers, and resynchronisation after damage."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from lsds.errors import DataError, ProtocolFault

LONGEST_PART = 64 * 1024 * 1024
"""Maximum length of a body, bytes; chosen above any uncompressed picture."""
LONGEST_HEADERS = 64 * 1024
"""Maximum length of the headers of a part, bytes; chosen."""
_MOST_SKIPPED = 4 * 1024 * 1024
"""Maximum number of bytes without a boundary before the stream counts as broken; chosen."""


class Part(NamedTuple):
    """One part: headers by lower-case name, body, and arrival time of the headers (monotonic ns)."""

    headers: dict[str, str]
    body: bytes
    arrived_ns: int


class PartReader:
    """Reads parts from a stream of bytes.

    `more` returns some bytes, empty at the end; `now` returns the monotonic time. Raises ConnectionError at the end.
    """

    def __init__(self, device: str, boundary: str, more: Callable[[], bytes], now: Callable[[], int]) -> None:
        self._device = device
        # Servers disagree on whether the dashes belong to the boundary's name.
        self._mark = b"--" + boundary.strip().strip('"').removeprefix("--").encode("latin-1", "replace")
        self._more = more
        self._now = now
        self._data = bytearray()

    def next(self) -> Part:
        """Return the next part. Raises DataError for a damaged part, ProtocolFault if the stream is not multipart."""
        self._skip_to_mark()
        headers = self._headers()
        arrived_ns = self._now()
        body = self._body(headers)
        return Part(headers, body, arrived_ns)

    def _skip_to_mark(self) -> None:
        skipped = 0
        while (at := self._data.find(self._mark)) < 0 or self._data.find(b"\n", at) < 0:
            if at < 0:
                spare = max(0, len(self._data) - len(self._mark))
                skipped += spare
                del self._data[:spare]
            if skipped > _MOST_SKIPPED or len(self._data) > LONGEST_HEADERS + _MOST_SKIPPED:
                raise ProtocolFault(
                    self._device, "no part begins in the stream", remedy="is the address that of an MJPEG stream?"
                )
            self._fill()
        del self._data[: self._data.find(b"\n", at) + 1]

    def _headers(self) -> dict[str, str]:
        while True:
            ends = [end for blank in (b"\r\n\r\n", b"\n\n") if (end := self._data.find(blank)) >= 0]
            if ends:
                break
            if len(self._data) > LONGEST_HEADERS:
                raise DataError("the frame's headers do not end (damaged on the way)")
            self._fill()
        end = min(ends)
        text = bytes(self._data[:end]).decode("latin-1")
        del self._data[: end + (4 if self._data[end : end + 2] == b"\r\n" else 2)]
        pairs = (line.partition(":") for line in text.splitlines())
        return {name.strip().lower(): value.strip() for name, _, value in pairs}

    def _body(self, headers: dict[str, str]) -> bytes:
        text = headers.get("content-length", "")
        if not text.isdecimal() or not 0 < int(text) <= LONGEST_PART:
            return self._body_to_mark()
        length = int(text)
        while len(self._data) < length:
            self._fill()
        body = bytes(self._data[:length])
        # A truncated part contains the beginning of the next one, which must be put back into the buffer.
        if not body.rstrip(b"\0").endswith(b"\xff\xd9") and (cut := body.find(self._mark)) >= 0:
            del self._data[:cut]
            raise DataError("the frame is shorter than announced (cut short on the way)")
        del self._data[:length]
        return body

    def _body_to_mark(self) -> bytes:
        begin = 0
        while (at := self._data.find(b"\r\n" + self._mark, begin)) < 0:
            begin = max(0, len(self._data) - len(self._mark) - 2)
            if len(self._data) > LONGEST_PART:
                raise DataError("the frame does not end (damaged on the way)")
            self._fill()
        body = bytes(self._data[:at])
        del self._data[:at]
        return body

    def _fill(self) -> None:
        data = self._more()
        if not data:
            raise ConnectionError("the stream has ended")
        self._data += data
