"""Labels by eye: a CSV of intervals for each video, and the state of each frame.

Columns: video, first, last (frames, both included), state, tx_px, ty_px, turn_deg, confidence, labeller, note. The
intervals of a video cover its frames from 0 on, in order, without gaps. A frame belongs to the motion that led to it.
`docs/labelling.md` is the protocol.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lsds.errors import DataError
from lsds.session.recording import ENDING
from lsds.support.files import write_whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

VIDEO_ENDINGS = (".avi", ".mp4", ".mkv", ".mov", ".webm", ENDING)
PROTOCOL = "labelled"
"""Value of a dataset's column `protocol` for frames labelled by eye."""
NAME = "slip_labels.csv"
"""Name of the label file in a folder of recordings."""
COLUMNS = ("video", "first", "last", "state", "tx_px", "ty_px", "turn_deg", "confidence", "labeller", "note")
_NEEDED = COLUMNS[:4]
_SHOWN_PROBLEMS = 5
"""Maximum number of problems that a message lists; chosen."""


class State(IntEnum):
    """State of the object in a frame."""

    FREE = 0
    STICK = 1
    SLIP = 2
    TOUCH = 3
    UNSURE = 4


@dataclass(frozen=True, slots=True)
class Interval:
    """Frames `first` to `last`, both included, of one state. Of a slip: travel of the imprint against the gel over the
    interval (px of a 320 px wide image, x right, y down) and its turn (degrees, clockwise); NaN if unknown.
    `confidence` in [0, 1]."""

    first: int
    last: int
    state: State
    tx_px: float = math.nan
    ty_px: float = math.nan
    turn_deg: float = math.nan
    confidence: float = 1.0
    labeller: str = ""
    note: str = ""

    def __len__(self) -> int:
        return self.last - self.first + 1


Labels = dict[str, list[Interval]]
"""The intervals of each video, by the name of its file without the ending."""


def name_of(recording: Path) -> str:
    """Return the name of a recording: of a video without its ending, or of a folder of images."""
    return recording.stem if recording.suffix.lower() in VIDEO_ENDINGS else recording.name


def read_labels(path: Path) -> Labels:
    """Read a file of labels. Raises DataError with all wrong lines."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise DataError(f"{path}: no such file (lsds learn label makes one)") from None
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{path}: cannot be read: {error}") from error
    reader = csv.DictReader(io.StringIO(text, newline=""))
    missing = [name for name in _NEEDED if name not in (reader.fieldnames or ())]
    if missing:
        raise DataError(f"{path}: column{'s' * (len(missing) > 1)} {', '.join(missing)} missing")
    labels: Labels = {}
    problems: list[str] = []
    try:
        for row in reader:
            _take(labels, row, reader.line_num, problems)
    except csv.Error as error:
        raise DataError(f"{path}: line {reader.line_num}: {error}") from error
    if problems:
        more = f"; and {len(problems) - _SHOWN_PROBLEMS} more" if len(problems) > _SHOWN_PROBLEMS else ""
        raise DataError(f"{path}: {'; '.join(problems[:_SHOWN_PROBLEMS])}{more}")
    return labels


def _take(labels: Labels, row: Mapping[str, str | None], line: int, problems: list[str]) -> None:
    cells = {name: (row.get(name) or "").strip() for name in COLUMNS}
    before = len(problems)

    def number(name: str, least: float, most: float, missing: float) -> float:
        try:
            value = float(cells[name]) if cells[name] else missing
        except ValueError:
            value = math.inf
        if not (least <= value <= most or (math.isnan(value) and math.isnan(missing))):
            problems.append(f"line {line}: {name} is {cells[name]!r}, not a number from {least:g} to {most:g}")
        return value

    first, last = number("first", 0, 1e7, math.inf), number("last", 0, 1e7, math.inf)
    names = [state.name.lower() for state in State]
    if cells["state"].lower() not in names:
        problems.append(f"line {line}: state is {cells['state']!r}, not one of {', '.join(names)}")
    if not cells["video"]:
        problems.append(f"line {line}: video is empty")
    x, y, turn = (number(name, -1e4, 1e4, math.nan) for name in ("tx_px", "ty_px", "turn_deg"))
    confidence = number("confidence", 0, 1, 1.0)
    if len(problems) > before:
        return
    intervals = labels.setdefault(name_of(Path(cells["video"])), [])
    expected = intervals[-1].last + 1 if intervals else 0
    if first != expected or last < first or last != int(last):
        problems.append(f"line {line}: frames {first:g} to {last:g}, but {cells['video']} goes on at {expected}")
    else:
        state = State[cells["state"].upper()]
        rest = (confidence, cells["labeller"], cells["note"])
        intervals.append(Interval(int(first), int(last), state, x, y, turn, *rest))


def write_labels(path: Path, labels: Labels) -> None:
    """Write labels atomically. Raises DataError."""
    out = io.StringIO(newline="")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for video, intervals in labels.items():
        for own in intervals:
            moved = ["" if math.isnan(value) else f"{value:g}" for value in (own.tx_px, own.ty_px, own.turn_deg)]
            state = own.state.name.lower()
            row = [video, own.first, own.last, state, *moved, f"{own.confidence:g}", own.labeller, own.note]
            writer.writerow(row)
    write_whole(path, out.getvalue().encode())


def states(intervals: Sequence[Interval], count: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return state and confidence of each of `count` frames; unlabelled frames are unsure with confidence 0."""
    state, confidence = np.full(count, int(State.UNSURE)), np.zeros(count)
    for own in intervals:
        state[own.first : own.last + 1] = own.state
        confidence[own.first : own.last + 1] = own.confidence
    return state, confidence
