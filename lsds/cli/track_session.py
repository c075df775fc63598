"""Track one recording or a batch, without printing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lsds.cli.threads import processes
from lsds.config import load_config
from lsds.errors import DataError, LsdsError
from lsds.registry import PluginHost
from lsds.session.recording import ENDING
from lsds.session.track import TrackResult, track
from lsds.support.processes import DIED, spread

VIDEO_ENDINGS = (".avi", ".mp4", ".mov", ".mkv", ".webm", ".m4v", ".mjpeg", ".mjpg", ENDING)
#: A reference with at least this many markers shows a whole pad; with fewer it is zoomed or cropped.
WHOLE_PAD_TRACKED = 60


def find_videos(sources: Sequence[str]) -> list[str]:
    """Return the named videos and all videos below the named folders, sorted. Raises DataError for no videos."""
    found: list[str] = []
    for source in sources:
        path = Path(source).expanduser()
        if path.is_dir():
            found += sorted(str(p) for p in path.rglob("*") if p.suffix.lower() in VIDEO_ENDINGS)
        elif path.exists():
            found.append(str(path))
        else:
            raise DataError(f"{source}: no such file or folder; check the path")
    if not found:
        raise DataError(f"{', '.join(sources)}: no videos found (searched for {', '.join(VIDEO_ENDINGS)})")
    return found


def track_one(source: str, config_file: Path | None, overrides: Sequence[str], bar: Any = None) -> TrackResult:
    """Track one recording, with a progress bar. Raises ConfigError, PluginError."""

    def advance(done: int, claimed: int) -> None:
        bar.length = max(claimed, done)
        bar.update(1)

    return track(source, config_file, overrides, progress=None if bar is None else advance)


def track_many(
    sources: Sequence[str], config_file: Path | None, overrides: Sequence[str], jobs: int | None
) -> Iterator[dict[str, Any]]:
    """Yield the summary of each recording when it is done. A failed recording does not stop the others."""
    # Check the config once, so that a typo is one error and not one per recording.
    host = PluginHost()
    video = f"sensor.backend={host.own('sensor', 'video')}"
    load_config(config_file, [*overrides, video, "sensor.video.path=x"], host=host)
    work = partial(_summary_of, config_file=config_file, overrides=tuple(overrides))
    # A worker takes a second to start: one recording does not need any.
    jobs = (jobs or processes()) if len(sources) > 1 else 1
    for source, summary in spread(work, sources, jobs):
        yield _failed(source, f"{source}: {DIED}") if summary is None else summary


def overview(results: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures over all recordings. Sorts the results by name first, because they arrive in any order."""
    results.sort(key=lambda r: str(r["source"]))
    good = [r for r in results if r["kept_mean"] is not None]
    whole = [r for r in good if r["markers"] >= WHOLE_PAD_TRACKED]
    worst = min(good, key=lambda r: r["kept_mean"], default=None)
    return {
        "recordings": len(results),
        "failed": sum(r["error"] is not None for r in results),
        "with_unusable_frames": sum(bool(r["failures"]) for r in results),
        "frames": sum(r["frames"] for r in results),
        "markers_kept_median": _median([r["kept_mean"] for r in good]),
        f"with_{WHOLE_PAD_TRACKED}_or_more_dots": len(whole),
        f"markers_kept_median_{WHOLE_PAD_TRACKED}_or_more_dots": _median([r["kept_mean"] for r in whole]),
        f"markers_kept_worst_{WHOLE_PAD_TRACKED}_or_more_dots": min((r["kept_mean"] for r in whole), default=None),
        "markers_kept_worst": worst["kept_mean"] if worst else None,
        "worst_recording": worst["source"] if worst else None,
    }


def draw(result: TrackResult, path: Path) -> None:
    """Write the picture of a recording. Raises DataError if the file cannot be written."""
    from lsds.session.pictures.track import plot_track

    try:
        plot_track(path, result)
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: the picture cannot be written: {error}") from error


def _summary_of(source: str, config_file: Path | None, overrides: tuple[str, ...]) -> dict[str, Any]:
    try:
        return track_one(source, config_file, overrides).summary()
    except Exception as error:
        # A failure in one recording, or of a plugin on it, must not lose the results of the others.
        return _failed(
            source, str(error) if isinstance(error, LsdsError) else f"{source}: {type(error).__name__}: {error}"
        )


def _failed(source: str, reason: str) -> dict[str, Any]:
    return TrackResult(source, error=reason).summary()


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None
