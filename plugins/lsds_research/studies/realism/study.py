"""Recordings and simulated clips through one tracker: quantiles of what it finds, side by side."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from lsds_research.studies.realism.camera import camera_row, camera_table
from lsds_research.studies.realism.clips import draw
from lsds_research.studies.realism.film import film, write
from lsds_research.studies.realism.imprint import QUARTILES, Row, relief_row, relief_table
from lsds_research.studies.realism.plot import plot
from lsds_research.studies.realism.quantiles import QUANTILES, inside, overlap, quantiles
from lsds_research.studies.realism.quantities import QUANTITIES, Samples, clip_samples, pooled

from lsds.clock import VirtualClock
from lsds.config import load_config
from lsds.config.toml import value_text
from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult, StudyTable, Value
from lsds.errors import DataError
from lsds.registry.host import PluginHost
from lsds.session.track import TrackResult, track_recording

if TYPE_CHECKING:
    from lsds_research.studies.realism.options import RealismOptions

    from lsds.config import RigConfig

ENDINGS = (".avi", ".mp4", ".mov", ".mkv")
COLUMNS = (
    ("quantity", "quantity", ""),
    ("unit", "unit", ""),
    ("of", "of", ""),
    *((f"p{q}", f"{q} %", ".4g") for q in QUANTILES),
    ("overlap", "overlap", ".2f"),
    ("inside", "in real 5-95 %", ".2f"),
)
RELIEF = (
    ("relief", "relief", ""),
    ("cycles_per_mm", "cycles/mm", ""),
    ("of", "of", ""),
    ("clips", "clips", "d"),
    *((f"p{q}", f"{q} %", ".4f") for q in QUARTILES),
)
#: Sides of the comparison; the last one is of the relief alone.
REAL, SIMULATED, PLAIN = "real", "simulated", "simulated, no grain"


class RealismStudy:
    """A `Study`."""

    def __init__(self, options: RealismOptions, context: BuildContext) -> None:
        self.options = options
        self._host = PluginHost()

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Track all. Raises DataError where there are no videos, or one cannot be read."""
        options = self.options
        videos = find_videos(options.recordings, options.videos)
        plain = min(options.plain, options.clips)
        whole = len(videos) + options.clips + plain
        tick(0, whole)
        real, simulated = _Side(), _Side()
        for done, path in enumerate(videos, 1):
            try:
                real.take(self._track(path), self._camera(path), relief_row(path))
            except DataError as error:
                raise DataError(f"{error} (take it out of the folder, or record it again)") from error
            tick(done, whole)
        without: list[Row] = []
        with tempfile.TemporaryDirectory() as folder:
            for number in range(options.clips):
                clip = draw(options, number)
                # Through a file and its codec, as the recordings came: a codec holds still pixels and moves dots.
                path = Path(folder) / f"clip{number}.avi"
                write(film(clip, options.seed), path, options.codec)
                simulated.take(self._track(path), self._camera(path), relief_row(path))
                if number < plain:
                    write(film(replace(clip, cell={**clip.cell, "grain_um": 0.0}), options.seed), path, options.codec)
                    without.append(relief_row(path))
                path.unlink()
                tick(len(videos) + number + 1 + len(without), whole)
        rows, curves = compare(pooled(real.samples), pooled(simulated.samples))
        notes = [
            f"real: {real.told}; simulated: {simulated.told} ({options.fidelity}, codec {options.codec})",
            "overlap: of the two histograms, 0 to 1; in real 5-95 %: share of simulated values, 0.90 at best",
            "frames of recordings are not equally spaced in time: speeds are a frame's, not a second's",
            "relief: RMS curvature in octave bands (1/mm) inside the contact and beside it, and its correlation from "
            "one frame to the next, moved along with the gel; of clips that do not begin with an object held",
        ]
        relief = relief_table({REAL: real.relief, SIMULATED: simulated.relief, PLAIN: without})
        camera = [
            {"of": "real", **camera_table(real.camera)},
            {"of": "simulated", **camera_table(simulated.camera)},
        ]
        clips = {"real": len(real.samples), "simulated": len(simulated.samples)}
        title = "Recordings and simulated clips, same tracker: quantiles side by side"
        return StudyResult(
            title,
            COLUMNS,
            rows,
            partial(plot, curves=curves, clips=clips, relief=relief),
            notes,
            {"camera": camera, "relief": relief},
            [StudyTable(RELIEF, relief)],
        )

    def _track(self, path: Path) -> TrackResult:
        return track_recording(self._config(path), self._host)

    def _camera(self, path: Path) -> dict[str, float | bool | None]:
        config = self._config(path)
        context = BuildContext(VirtualClock(), 0)
        sensor: Any = self._host.build("sensor", config.sensor.backend, config.sensor.options(), context)
        return camera_row(frame.image for frame in sensor.frames())

    def _config(self, path: Path) -> RigConfig:
        # The first frame only is the reference, as in `lsds track`.
        video = self._host.own("sensor", "video")
        changes = [
            "tactile.reference_frames=1",
            f"sensor.backend={video}",
            f"sensor.video.path={value_text(str(path))}",
        ]
        return load_config(None, changes, host=self._host)


class _Side:
    """The values of one side (real or simulated) so far."""

    def __init__(self) -> None:
        self.samples: list[Samples] = []
        self.camera: list[dict[str, float | bool | None]] = []
        self.relief: list[Row] = []
        self._frames = 0
        self._unusable = 0

    def take(self, result: TrackResult, camera: dict[str, float | bool | None], relief: Row) -> None:
        self.samples.append(clip_samples(result))
        self.camera.append(camera)
        self.relief.append(relief)
        self._frames += result.frames
        self._unusable += len(result.failures)

    @property
    def told(self) -> str:
        return f"{len(self.samples)} clips, {self._frames} frames, {self._unusable} of them not to be followed"


def find_videos(folder: str, count: int) -> list[Path]:
    """Return `count` videos spread evenly over all below the folder, sorted by name; all of them for 0."""
    if not folder:
        raise DataError("no recordings named (--recordings takes a folder of videos)")
    root = Path(folder).expanduser()
    found = sorted(p for p in root.rglob("*") if p.suffix.lower() in ENDINGS) if root.is_dir() else []
    if not found:
        what = "no videos there" if root.is_dir() else "there is no such folder"
        raise DataError(f"{folder}: {what} (--recordings takes a folder that holds {', '.join(ENDINGS)} files)")
    if not 0 < count < len(found):
        return found
    return [found[round(k)] for k in np.linspace(0, len(found) - 1, count)]


def compare(real: Samples, simulated: Samples) -> tuple[list[dict[str, Value]], dict[str, dict[str, Any]]]:
    """Return two rows a quantity, real and simulated, and by quantity the curves that the chart draws."""
    rows: list[dict[str, Value]] = []
    curves: dict[str, dict[str, Any]] = {}
    levels = np.linspace(0, 100, 501)
    for quantity in QUANTITIES:
        a, b = real[quantity.key], simulated[quantity.key]
        if not len(a) or not len(b):
            side = "simulated clips" if len(a) else "recordings"
            raise DataError(f"no {quantity.name} in any of the {side}: none of their dots can be followed")
        both = {"overlap": overlap(a, b), "inside": inside(b, a)}
        same: dict[str, Value] = {"quantity": quantity.name, "unit": quantity.unit}
        rows.append({**same, "of": "real", "n": len(a), **quantiles(a), "overlap": None, "inside": None})
        rows.append({**same, "of": "simulated", "n": len(b), **quantiles(b), **both})
        curves[quantity.key] = {
            "levels": levels,
            "real": np.percentile(a, levels),
            "simulated": np.percentile(b, levels),
            **both,
        }
    return rows, curves
