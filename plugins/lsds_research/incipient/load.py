"""Loads a folder of labelled videos in parallel, with a cache: a second load takes seconds."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.errors import DataError
from lsds.models.signals import SIGNALS
from lsds.support.processes import DIED, spread
from lsds_research import datasets
from lsds_research.clips.signals import CLIP_SIGNALS
from lsds_research.datasets import Dataset
from lsds_research.incipient.index import Video, joined, read_index
from lsds_research.incipient.look import LOOKS
from lsds_research.incipient.video import COLUMNS_VERSION, try_columns

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Columns = dict[str, NDArray[Any]]


def default_cache() -> Path:
    """Return the user's cache folder."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if base else Path.home() / ".cache") / "lsds" / "incipient-slip"


def load(
    folder: Path, jobs: int = 1, cache: Path | None = None, progress: Callable[[int, int], object] | None = None
) -> Dataset:
    """Return the dataset of a folder's videos; `card["failures"]` gives the reason for each unreadable video,
    `card["not_kept"]` the reason if the cache could not be written.

    `cache` is a folder for finished datasets, keyed by the videos' names, sizes and times and by version;
    `progress(done, videos)` is called as videos are done. Raises DataError for an invalid index, or without a readable
    video.
    """
    videos = read_index(folder)
    key = _key(videos)
    place = None if cache is None else cache / key
    if place is not None and (place / datasets.CARD).is_file():
        try:
            kept = datasets.load(place)
            if all(name in kept.columns for name in (*CLIP_SIGNALS, *LOOKS)):
                return kept
        except DataError:
            pass  # A truncated cache is rebuilt.
    parts: dict[str, Columns] = {}
    failures: dict[str, str] = {}
    for done, (video, found) in enumerate(spread(try_columns, videos, jobs), start=1):
        if found is None:
            failures[video.name] = f"{video.path}: {DIED}"
        elif isinstance(found, str):
            failures[video.name] = found
        else:
            parts[video.name] = found
        if progress is not None:
            progress(done, len(videos))
    card = {
        "made_from": folder.name,
        "figures_are": "measured",
        "clock": "nominal: true frame times unknown, so no figure in it is a speed",
        "videos": {
            v.name: {"recording": v.recording, "camera": v.camera, "conflict": v.conflict, "bytes": size_of(v.path)}
            for v in videos
        },
        "failures": dict(sorted(failures.items())),
    }
    if not parts:
        raise DataError(
            f"{folder}: none of its {len(videos)} videos can be used; the first: {next(iter(failures.values()))}"
        )
    data = joined([parts[v.name] for v in videos if v.name in parts], card)
    if place is not None:
        try:
            data.save(place)
        except DataError as error:
            # Without a cache the dataset is still valid.
            return Dataset(data.columns, {**card, "not_kept": str(error)})
    return data


def size_of(path: Path) -> int:
    """Return a file's size in bytes, 0 if unknown."""
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _key(videos: Sequence[Video]) -> str:
    """Return a name that changes with the index, any video's size or time, and what is computed."""
    content: list[Any] = [COLUMNS_VERSION, SIGNALS, CLIP_SIGNALS]
    for video in videos:
        try:
            found = video.path.stat()
            state = (found.st_size, found.st_mtime_ns)
        except OSError:
            state = (-1, -1)
        content.append((str(video.path.name), video.name, video.object, video.slip, video.conflict, state))
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:20]
