"""A slot for one picture: a late reader gets the newest picture, not a queue."""

from __future__ import annotations

import threading
from typing import NamedTuple


class Picture(NamedTuple):
    """One encoded picture: JPEG bytes, exposure time (monotonic ns), number since the camera started."""

    jpeg: bytes
    t_ns: int
    seq: int


class Newest:
    """Gives the newest picture to any number of waiting readers."""

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._picture: Picture | None = None
        self._number = 0
        self._closed = False

    def put(self, picture: Picture) -> None:
        """Replace the picture and wake all waiting readers."""
        with self._condition:
            self._picture = picture
            self._number += 1
            self._condition.notify_all()

    def close(self) -> None:
        """Wake all waiting readers without a picture."""
        with self._condition:
            self._closed = True
            self._condition.notify_all()

    @property
    def number(self) -> int:
        """Number of pictures so far."""
        return self._number

    def after(self, number: int, timeout_s: float) -> tuple[int, Picture] | None:
        """Wait for a picture after the `number`-th; return (its number, picture), or None on timeout."""
        with self._condition:
            self._condition.wait_for(lambda: self._closed or self._number > number, timeout_s)
            if self._closed or self._number <= number or self._picture is None:
                return None
            return self._number, self._picture
