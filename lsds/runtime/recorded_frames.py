"""Iterate over recordings: every frame of every finger in order of time, independent of any clock."""

from __future__ import annotations

import heapq
import itertools
from typing import TYPE_CHECKING, Any

from lsds.errors import DataError, LsdsError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lsds.contracts import Frame
    from lsds.runtime.finger_pipeline import FingerLine


def all_frames(lines: Sequence[FingerLine], start_ns: int) -> Iterator[tuple[Frame, FingerLine]]:
    """Yield each frame with the line that it belongs to; the first frames are stamped `start_ns`.

    Raises DataError if a recording ends early; an error of a decoder names the frame.
    """
    recordings = [_frames(line, start_ns) for line in lines]
    yield from heapq.merge(*recordings, key=lambda item: item[0].t_ns)


def _frames(line: FingerLine, start_ns: int) -> Iterator[tuple[Frame, FingerLine]]:
    sensor: Any = line.finger.sensor
    recording = sensor.frames(start_ns)
    for number in itertools.count():
        try:
            frame = next(recording, None)
        except LsdsError:
            raise
        except Exception as error:
            raise DataError(f"frame {number}: {type(error).__name__}: {error}") from error
        if frame is None:
            return
        yield frame, line
