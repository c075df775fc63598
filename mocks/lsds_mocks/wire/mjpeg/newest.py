"""A slot that holds one picture: who comes late gets the newest, never a queue."""

from __future__ import annotations

import threading
from typing import NamedTuple


class Picture(NamedTuple):
    """One encoded picture: JPEG bytes, when its exposure was (monotonic ns), its number since the camera started."""

    jpeg: bytes
    t_ns: int
    seq: int


class Newest:
    """Hands the newest picture to any number of waiting readers."""

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._picture: Picture | None = None
        self._number = 0
        self._closed = False

    def put(self, picture: Picture) -> None:
        """Replace the picture and wake all who wait."""
        with self._condition:
            self._picture = picture
            self._number += 1
            self._condition.notify_all()

    def close(self) -> None:
        """Let all who wait go with empty hands."""
        with self._condition:
            self._closed = True
            self._condition.notify_all()

    @property
    def number(self) -> int:
        """How many pictures there have been."""
        return self._number

    def after(self, number: int, timeout_s: float) -> tuple[int, Picture] | None:
        """Wait for a picture later than the `number`-th; return (its number, it), None where none came in time."""
        with self._condition:
            self._condition.wait_for(lambda: self._closed or self._number > number, timeout_s)
            if self._closed or self._number <= number or self._picture is None:
                return None
            return self._number, self._picture
