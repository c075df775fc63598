"""Times of the frames of a recording."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

from lsds.errors import DataError

Timestamps = Literal["nominal", "file", "list"]


class FrameTimes:
    """Seconds since the first frame. `nominal` counts frames; the others use the stored times, which must increase."""

    def __init__(self, path: str, kind: Timestamps, rate_hz: float, listed: list[float] | None) -> None:
        self._path = path
        self._kind = kind
        self._rate_hz = rate_hz
        self._listed = listed
        self._first: float | None = None
        self._last = -math.inf

    def of(self, number: int, file_s: float, missing: int = 0) -> float:
        """Return the time of frame `number`, whose stored time is `file_s`. Raises DataError.

        `missing` is the number of frames before it that the recording lacks; stored times know them.
        """
        if self._kind == "nominal":
            return (number + missing) / self._rate_hz
        if self._listed is not None:
            if number >= len(self._listed):
                raise DataError(f"{self._path}: frame {number} has no time, the list ends at {len(self._listed)}")
            file_s = self._listed[number]
        if not math.isfinite(file_s):
            raise DataError(f"{self._path}: frame {number} has no time stamp (use sensor.video.timestamps='nominal')")
        if file_s <= self._last:
            raise DataError(
                f"{self._path}: frame {number} is stamped {file_s:.6f} s, not after the one before it "
                f"({self._last:.6f} s); use sensor.video.timestamps='nominal'"
            )
        self._first = file_s if self._first is None else self._first
        self._last = file_s
        return file_s - self._first


def read_times(file: str) -> list[float]:
    """Return the times in a text file, one in seconds per line; blank lines and lines after # are left out.

    Raises DataError that names the line.
    """
    try:
        lines = Path(file).expanduser().read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{file}: the list of times cannot be read: {error}") from error
    times = []
    for number, line in enumerate(lines, start=1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        try:
            times.append(float(text))
        except ValueError:
            raise DataError(f"{file}: line {number}: {text!r} is not a time in seconds") from None
    return times
