"""Outputs of detectors and estimators for each frame of a recording, and the signals for learners."""

from __future__ import annotations

import glob
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from lsds_plugins.replay.reader import IMAGE_ENDINGS

from lsds.calibration.watched import fastest_px
from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.errors import DataError, LsdsError, naming
from lsds.models.signals import SIGNALS, signals_of
from lsds.registry import PluginHost
from lsds.tactile.reference import brightness
from lsds.tactile.working_image import WIDTH_PX
from lsds_research.recording_engine import WHOLE_PAD_VISIBLE, recording_engine
from lsds_research.slips.labels import VIDEO_ENDINGS, name_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


@dataclass(slots=True, eq=False)
class Outputs:
    """The outputs for a recording of `count` frames: one row per frame, NaN if missing. Lengths are px of an image 320
    px wide.

    `moved_px` (n,): motion of the fastest tenth of the markers; `slip` and `score` (n,) by detector; `slid` (n, 3)
    by estimator: px, px and degrees since the last frame; `signals` (n, S). `markers` is the number of markers
    in the reference.
    """

    name: str
    count: int
    markers: int
    moved_px: Floats
    redrawn: NDArray[np.bool_]
    signals: NDArray[np.float32]
    slip: dict[str, Floats] = field(default_factory=dict)
    score: dict[str, Floats] = field(default_factory=dict)
    slid: dict[str, Floats] = field(default_factory=dict)

    @property
    def setup(self) -> str:
        """Setup of the recording, by the number of visible markers."""
        return "whole pad" if self.markers >= WHOLE_PAD_VISIBLE else "zoomed pad"


def find_recording(folder: Path, name: str) -> Path | None:
    """Return the video or the folder of images of that name below `folder`, or None."""
    for path in sorted(folder.rglob(f"{glob.escape(name)}*")):
        if path.stem == name and path.suffix.lower() in VIDEO_ENDINGS and path.is_file():
            return path
        if path.name == name and path.is_dir() and any(f.suffix.lower() in IMAGE_ENDINGS for f in path.iterdir()):
            return path
    return None


def watch(path: Path, detectors: Sequence[str], estimators: Sequence[str]) -> Outputs | str:
    """Return the outputs for a recording, or the reason of a failure."""
    try:
        return _watch(path, detectors, estimators)
    except LsdsError as error:
        return naming(path, error)


def _watch(path: Path, detectors: Sequence[str], estimators: Sequence[str]) -> Outputs:
    host, context = PluginHost(), BuildContext(VirtualClock(), 0)
    built = {name: host.build("detector", name, {}, context) for name in detectors}
    slid = {name: host.build("estimator", name, {}, context) for name in estimators}
    engine = recording_engine(path)
    numbers: list[int] = []
    moved: list[list[float]] = []
    rows: dict[str, list[list[float]]] = {name: [] for name in detectors}
    estimates: dict[str, list[list[float]]] = {name: [] for name in estimators}
    signals, redrawn = [], []
    for cycle in engine:
        observation = cycle.observation
        metres = engine.perception.metres_per_px * observation.field.reference.image_size[0] / WIDTH_PX
        numbers.append(cycle.frame.seq)
        signals.append(signals_of(observation, brightness(cycle.frame)))
        redrawn.append(cycle.frame.redrawn)
        moved.append([fastest_px(observation, engine.perception.metres_per_px)])
        for name, detector in built.items():
            detection = detector.update(observation)
            rows[name].append([math.nan if detection.slip is None else float(detection.slip), detection.score])
        for name, estimator in slid.items():
            estimate = estimator.update(observation)
            dt = observation.dt_s
            step = [v * dt / metres for v in estimate.velocity_m_s] + [math.degrees(estimate.angular_rad_s * dt)]
            estimates[name].append([math.nan] * 3 if estimate.abstained else step)
    reference = engine.perception.reference
    if reference is None or not numbers:
        raise DataError(f"{path}: no usable frame after the reference")
    count, where = numbers[-1] + 1, np.array(numbers)

    def spread(values: list[list[float]]) -> Floats:
        whole = np.full((count, len(values[0])), np.nan)
        whole[where] = values
        return whole

    everything = np.full((count, len(SIGNALS)), np.nan, np.float32)
    everything[where] = signals
    is_redrawn = np.zeros(count, bool)
    is_redrawn[where] = redrawn
    detections = {name: spread(rows[name]) for name in detectors}
    return Outputs(
        name_of(path),
        count,
        reference.count,
        np.nan_to_num(spread(moved)[:, 0]),
        is_redrawn,
        everything,
        {name: values[:, 0] for name, values in detections.items()},
        {name: values[:, 1] for name, values in detections.items()},
        {name: spread(values) for name, values in estimates.items()},
    )
