"""A folder of labelled recordings: its labels, recordings and objects, also as a dataset."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.errors import DataError
from lsds.support.processes import DIED, spread
from lsds_research.datasets import Dataset, from_rows, joined
from lsds_research.slips.labels import NAME, PROTOCOL, Interval, Labels, name_of, read_labels
from lsds_research.slips.outputs import Outputs, find_recording, watch
from lsds_research.slips.score import LabelledOutputs, scored_frames

if TYPE_CHECKING:
    from numpy.typing import NDArray

_DATA = Path(__file__).parent / "data"
SHIPPED, SECOND = _DATA / "incipient_slip.csv", _DATA / "incipient_slip_second.csv"
STILL_FRAMES_PER_USED = 2
"""Training uses one still frame in this many, because still frames are many and similar."""


def scored_only() -> frozenset[str]:
    """Return the objects of the shipped labels on which nothing is tuned."""
    return frozenset((_DATA / "scored_only.txt").read_text(encoding="utf-8").split())


@dataclass(frozen=True, slots=True, eq=False)
class LabelledRecording:
    """A recording with its object, its labels, and the outputs of detectors and estimators."""

    object: str
    intervals: Sequence[Interval]
    outputs: Outputs

    def with_slip(self, slip: NDArray[np.float64]) -> LabelledOutputs:
        """Return the labels with a detector's output per frame (n,), without an estimate."""
        nothing = np.full((self.outputs.count, 3), np.nan)
        return LabelledOutputs(self.intervals, slip, self.outputs.moved_px, nothing[:, :2], nothing[:, 2])


def labels_of(folder: Path, file: Path | None = None) -> Labels:
    """Return the labels for a folder's recordings: those of `file`, of the folder's file, or the shipped ones.

    Raises DataError if no recording has labels.
    """
    if not folder.is_dir():
        raise DataError(f"{folder}: no such folder (give the one that holds the recordings)")
    own = file or (folder / NAME if (folder / NAME).is_file() else SHIPPED)
    labels = {
        name: intervals for name, intervals in read_labels(own).items() if find_recording(folder, name) is not None
    }
    if not labels:
        raise DataError(f"{folder}: holds none of the recordings that {own} labels (lsds learn label makes labels)")
    return labels


def read_folder(
    folder: Path,
    labels: Labels,
    detectors: Sequence[str] = (),
    estimators: Sequence[str] = (),
    jobs: int = 1,
    tick: Callable[[int, int], object] | None = None,
) -> tuple[list[LabelledRecording], dict[str, str]]:
    """Return the labelled recordings of a folder in the order of their names, and the reasons why others are
    unusable."""
    objects = _objects(folder)
    paths = {name: found for name in sorted(labels) if (found := find_recording(folder, name)) is not None}
    failures: dict[str, str] = {}
    seen: dict[str, Outputs] = {}
    work = partial(watch, detectors=tuple(detectors), estimators=tuple(estimators))
    for done, (path, result) in enumerate(spread(work, list(paths.values()), jobs), start=1):
        if isinstance(result, Outputs):
            beyond = [own for own in labels[result.name] if own.first >= result.count]
            if beyond:
                failures[result.name] = (
                    f"{path}: frames {beyond[0].first} to {beyond[0].last} are labelled, but it has {result.count} "
                    "frames; the labels are of another recording, or frames are missing"
                )
            else:
                seen[result.name] = result
        else:
            failures[name_of(path)] = f"{path}: {DIED}" if result is None else result
        if tick is not None:
            tick(done, len(paths))
    if not seen:
        raise DataError(
            f"{folder}: none of its labelled recordings can be used; the first: {next(iter(failures.values()))}"
        )
    labelled = [
        LabelledRecording(objects.get(name, name.split("__")[0]), labels[name], seen[name]) for name in sorted(seen)
    ]
    return labelled, failures


def _objects(folder: Path) -> dict[str, str]:
    """Return the object of each recording from index.csv, if present."""
    index = folder / "index.csv"
    if not index.is_file():
        return {}
    try:
        with index.open(encoding="utf-8-sig", newline="") as file:
            return {name_of(Path(row["video"])): row["object"] for row in csv.DictReader(file)}
    except (OSError, KeyError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{index}: cannot be read: {error!r} (columns video, object)") from error


def as_dataset(recordings: Sequence[LabelledRecording]) -> Dataset:
    """Return the training frames: all that slip, all that move and stick, and some still ones.

    All other frames have an unknown label.
    """
    parts: list[dict[str, NDArray[Any]]] = []
    for own in recordings:
        outputs = own.outputs
        frames = scored_frames(own.intervals, outputs.moved_px)
        slip = np.full(outputs.count, -1, np.int8)
        slip[frames.slip] = 1
        slip[frames.moving] = 0
        slip[np.flatnonzero(frames.still)[::STILL_FRAMES_PER_USED]] = 0
        t_s = (np.arange(outputs.count) / 25.0).tolist()
        parts.append(from_rows(outputs.name, own.object, PROTOCOL, t_s, outputs.signals, {"slip": slip}))
    card = {"figures_are": "measured", "job": PROTOCOL, "labels": "by eye", "clock": "nominal"}
    return joined(parts, card)
