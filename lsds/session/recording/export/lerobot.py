"""Recordings as a LeRobot dataset: an episode for each, at the rate of the cameras."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from lsds.errors import DataError
from lsds.session.recording.export.lerobot_dataset import LeRobotDataset
from lsds.session.recording.export.lerobot_features import Layout, survey
from lsds.session.recording.export.lerobot_samples import Sample, samples
from lsds.session.recording.export.target import new_folder
from lsds.session.recording.reader import Recording
from lsds.support.extras import require

TASK = "grasp, lift and hold an object"
"""Text of the task in a dataset, if none is given."""


def to_lerobot(
    paths: Sequence[Path],
    out: Path,
    progress: Callable[[int, int], None] | None = None,
    *,
    task: str = TASK,
    rate_hz: int | None = None,
) -> dict[str, int]:
    """Write recordings as a new dataset; return the frames by recording.

    `rate_hz` is by default that of the first finger's camera. Each episode is complete on disk before the next begins,
    and stays if a later one fails. Raises MissingExtra; DataError, also for recordings with other fingers or devices.
    """
    require("pyarrow", extra="data", purpose="an export to LeRobot")
    recordings = [Recording(path) for path in paths]
    layouts, counts = zip(*(survey(recording) for recording in recordings), strict=True)
    for recording, layout in zip(recordings, layouts, strict=True):
        if layout != layouts[0]:
            raise DataError(
                f"{recording.path}: differs from {recordings[0].path} in {_difference(layout, layouts[0])}; all "
                "episodes of a dataset have the same features (export it alone)"
            )
    rate = rate_hz or round(recordings[0].header.fingers[0].spec.rate_hz) or 1
    written: dict[str, int] = {}
    with new_folder(out) as target:
        dataset = LeRobotDataset(out, layouts[0].features(), rate, task)
        before = 0
        try:
            for recording, count in zip(recordings, counts, strict=True):
                found = samples(recording.messages(), layouts[0], rate, recording.path)
                frames = dataset.add(_reported(found, progress, before, sum(counts)))
                if not frames:
                    raise DataError(
                        f"{recording.path}: too short: images, states and markers are never all known (record a longer "
                        "run, or leave it out)"
                    )
                written[str(recording.path)] = written.get(str(recording.path), 0) + frames
                target.usable = True
                before += count
        except Exception as error:
            if dataset.episodes:
                error.add_note(f"{out}: complete episodes: {dataset.episodes}; they are kept")
            raise
    return written


def _reported(
    found: Iterable[tuple[int, Sample]], progress: Callable[[int, int], None] | None, before: int, whole: int
) -> Iterator[Sample]:
    for read, sample in found:
        if progress is not None:
            progress(before + read, whole)
        yield sample


def _difference(one: Layout, other: Layout) -> str:
    if one.arm != other.arm:
        return "having an arm"
    if [finger.name for finger in one.fingers] != [finger.name for finger in other.fingers]:
        return "the names of the fingers"
    return "the images, markers or load of a finger"
