"""Real recordings that are labelled as a whole: a folder with `index.csv` and videos, as one dataset.

`index.csv` names video, recording, object, camera and slip (1 where the recording contains slip, else 0), and
optionally `label_conflict` (1 if the label is in doubt). Each video is one recording of the dataset, called
`recording__camera`; both cameras of one recording share its label and are no independent trials.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.errors import DataError
from lsds_research.clips.signals import CLIP_SIGNALS
from lsds_research.datasets import COLUMNS, Dataset
from lsds_research.incipient.look import LOOKS

if TYPE_CHECKING:
    from numpy.typing import NDArray

INDEX = "index.csv"
PROTOCOL = "real"
_NEEDED = ("video", "recording", "object", "camera", "slip")
_SHOWN_PROBLEMS = 5
"""Maximum number of problems that a message lists; chosen."""


@dataclass(frozen=True, slots=True)
class Video:
    """One row of the index. `conflict` is true if its label is in doubt."""

    path: Path
    recording: str
    object: str
    camera: str
    slip: int
    conflict: bool = False

    @property
    def name(self) -> str:
        """Name of the video in the dataset's column `recording`."""
        return f"{self.recording}__{self.camera}"


def physical(name: str) -> str:
    """Return the recording of a video name; all cameras of a recording have the same."""
    return name.rpartition("__")[0]


def read_index(folder: Path) -> list[Video]:
    """Return the videos that a folder's index names, in its order.

    Raises DataError if the index is missing, lacks a column or has an invalid row;
    all problems are reported together.
    """
    path = folder / INDEX
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "there is no such folder"
        raise DataError(f"{folder}: {what} (give the folder that holds {INDEX} and the videos)")
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            missing = [name for name in _NEEDED if name not in (reader.fieldnames or ())]
            if missing:
                raise DataError(f"{path}: column{'s' * (len(missing) > 1)} {', '.join(missing)} missing")
            rows = list(reader)
    except FileNotFoundError:
        raise DataError(f"{folder}: no {INDEX} there (columns {', '.join(_NEEDED)}, one row a video)") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{path}: cannot be read: {error}") from error
    problems: list[str] = []
    videos = [_video(folder, number, row, problems) for number, row in enumerate(rows, start=2)]
    _consistent(videos, problems)
    if problems:
        more = f"; and {len(problems) - _SHOWN_PROBLEMS} more" if len(problems) > _SHOWN_PROBLEMS else ""
        raise DataError(f"{path}: {'; '.join(problems[:_SHOWN_PROBLEMS])}{more}")
    if not videos:
        raise DataError(f"{path}: names no videos")
    return videos


def _video(folder: Path, number: int, row: dict[str, str | None], problems: list[str]) -> Video:
    cells = {name: (row.get(name) or "").strip() for name in (*_NEEDED, "label_conflict")}
    problems += [f"line {number}: {name} is empty" for name in _NEEDED if not cells[name]]
    if cells["slip"] not in ("0", "1", ""):
        problems.append(f"line {number}: slip is {cells['slip']!r}, not 0 or 1")
    if cells["label_conflict"] not in ("0", "1", ""):
        problems.append(f"line {number}: label_conflict is {cells['label_conflict']!r}, not 0 or 1")
    return Video(
        folder / cells["video"],
        cells["recording"],
        cells["object"],
        cells["camera"],
        int(cells["slip"] == "1"),
        cells["label_conflict"] == "1",
    )


def _consistent(videos: Sequence[Video], problems: list[str]) -> None:
    first: dict[str, Video] = {}
    names: set[str] = set()
    for video in videos:
        if video.name in names:
            problems.append(f"recording {video.recording}, camera {video.camera} is named twice")
        names.add(video.name)
        before = first.setdefault(video.recording, video)
        if before.object != video.object:
            problems.append(f"recording {video.recording} is of {before.object} and of {video.object}")
        elif before.slip != video.slip and not (before.conflict or video.conflict):
            problems.append(f"recording {video.recording} has slip 0 and 1 (mark it in label_conflict)")


def joined(parts: Sequence[dict[str, NDArray[Any]]], card: dict[str, Any]) -> Dataset:
    """Return one dataset of videos' columns: those of every dataset, the signals of clips, and looks."""
    if not parts:
        raise DataError("none of the videos could be read: there is nothing to evaluate")
    names = (*COLUMNS, *CLIP_SIGNALS, *LOOKS)
    return Dataset({name: np.concatenate([part[name] for part in parts]) for name in names}, card)
