"""Study `slip`: detectors and estimators frame by frame, on real recordings labelled by eye."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.calibration.thresholds import Budget, exceeds, threshold, transferable
from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult, StudyTable
from lsds.registry.host import PluginHost
from lsds.support.extras import importable, require
from lsds_research.datasets import load, merged
from lsds_research.make_models import FUSED_THRESHOLD, OWN, training_part
from lsds_research.slips.folder import LabelledRecording, labels_of, read_folder, scored_only
from lsds_research.slips.labels import NAME
from lsds_research.slips.options import SlipOptions
from lsds_research.slips.plot import draw
from lsds_research.slips.refit import refitted, zero_shot
from lsds_research.slips.score import (
    Counts,
    LabelledOutputs,
    counted,
    onset_errors,
    scored_frames,
    scored_intervals,
    travels,
)
from lsds_research.study_backends import backend_names

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.datasets import Dataset

    Floats = NDArray[np.float64]
    Row = dict[str, Any]

_COLUMNS = (
    ("detector", "detector", ""),
    ("setup", "setup", ""),
    ("found", "found", ".2f"),
    ("noticed", "noticed", ".2f"),
    ("noticed_low", "95 %", ".2f"),
    ("noticed_high", "", ".2f"),
    ("intervals", "of", "d"),
    ("per_100_moving", "/100 moving", ".1f"),
    ("per_100_moving_high", "to", ".1f"),
    ("per_100_still", "/100 still", ".2f"),
    ("onset", "onset", ".0f"),
    ("slip_unanswered", "slip w/o answer", ".3f"),
    ("moving_unanswered", "moving w/o", ".3f"),
    ("at_found", "found at", ".2f"),
    ("at_noticed", "noticed at", ".2f"),
    ("at_low", "95 %", ".2f"),
    ("at_high", "", ".2f"),
    ("at_still", "/100 still at", ".2f"),
)
_TRAVELS = (
    ("estimator", "estimator", ""),
    ("slips", "slips", "d"),
    ("off_px", "off, px", ".1f"),
    ("off_share", "off, %", ".0f"),
    ("travel_right", "within 20 % or 2 px", ".2f"),
    ("turns", "turns", "d"),
    ("off_deg", "off, deg", ".1f"),
    ("turn_off_share", "off, %", ".0f"),
    ("turn_right", "within 15 % or 3 deg", ".2f"),
    ("answered", "answered", ".2f"),
)
ALL = "both"
CALIBRATED = ("fused", "imprint")
"""Detectors for which `lsds calibrate slip` is tried; by default nothing was fitted on the objects that are scored."""
_BOOTSTRAP_DRAWS = 300
"""Number of bootstrap samples of objects from which intervals are computed; chosen."""
Scores = list[tuple[LabelledRecording, "Floats", "Floats"]]
"""Of each recording what a detector decides (1, 0, NaN) and its score, both (n,)."""


class SlipStudy:
    """Reads the recordings once, runs all detectors and estimators, and compares them with the labels."""

    def __init__(self, options: SlipOptions, context: BuildContext) -> None:
        self._options, self._seed = options, context.seed

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Measure. Raises DataError for an unusable folder or labels, PluginError for an unknown name."""
        options, host = self._options, PluginHost()
        folder = Path(options.path)
        labels = labels_of(folder, Path(options.labels) if options.labels else None)
        detectors = backend_names(host, "detector", options.detectors)
        estimators = backend_names(host, "estimator", options.estimators)
        recordings, failures = read_folder(folder, labels, detectors, estimators, options.jobs, tick)
        kept = self._kept(recordings, folder)
        notes = _notes(kept, options.alarms)
        by_title = {
            name: [(own, own.outputs.slip[name], own.outputs.score[name]) for own in kept] for name in detectors
        }
        for title, scores in self._refitted(recordings).items():
            names = {own.outputs.name for own in kept}
            by_title[title] = [each for each in scores if each[0].outputs.name in names]
        by_title |= self._calibrated(kept, detectors)
        rows, curves = [], {}
        for name, scores in by_title.items():
            curves[name] = _curve(scores)
            rows += [_row(name, setup, part, self._options.alarms, self._seed) for setup, part in _by_setup(scores)]
        travel = [_travel_row(name, kept) for name in estimators]
        objects = len({own.object for own in kept})
        title = f"real recordings labelled by eye: {len(kept)} of {objects} objects (measured)"
        return StudyResult(
            title,
            _COLUMNS,
            rows,
            partial(draw, curves=curves, alarms=options.alarms, title=title),
            notes,
            {"failures": failures, "figures_are": "measured", "curves": curves, "seed": self._seed},
            more=[StudyTable(_TRAVELS, travel)] if travel else [],
            warnings=[f"passed over: {reason}" for reason in failures.values()],
        )

    def _kept(self, recordings: list[LabelledRecording], folder: Path) -> list[LabelledRecording]:
        """Return the recordings that are scored: of the shipped labels only objects on which nothing is tuned."""
        own_labels = self._options.labels or (folder / NAME).is_file()
        if own_labels or self._options.objects == "all":
            return recordings
        return [own for own in recordings if own.object in scored_only()] or recordings

    def _calibrated(self, kept: list[LabelledRecording], detectors: Sequence[str]) -> dict[str, Scores]:
        """Return the detectors calibrated as by `lsds calibrate slip`: each object with the threshold from the other
        scored objects of its setup."""
        calibrated: dict[str, Scores] = {}
        budget = Budget(self._options.alarms)
        for name in (name for name in CALIBRATED if name in detectors):
            scores: Scores = []
            for own in kept:
                others = [
                    each for each in kept if each.outputs.setup == own.outputs.setup and each.object != own.object
                ]
                least = _transferable(others, name, budget)
                if not math.isfinite(least):
                    break  # A setup of one object: nothing to calibrate on.
                score = own.outputs.score[name]
                known = np.isfinite(own.outputs.slip[name])
                scores.append((own, np.where(known, exceeds(score, least), np.nan), score))
            else:
                calibrated[f"{name}, calibrated"] = scores
        return calibrated

    def _refitted(self, recordings: list[LabelledRecording]) -> dict[str, Scores]:
        if not self._options.refit or not importable("sklearn"):
            return {}
        simulated = self._simulated()
        found = {
            "fused, without the object": refitted(recordings, lambda own: own.object, simulated),
            "fused, from the other setup": refitted(recordings, lambda own: own.outputs.setup, simulated),
        }
        if simulated is not None:
            found["fused, simulated only"] = zero_shot(recordings, simulated)
        return {
            title: [
                (own, np.where(np.isfinite(score), score > FUSED_THRESHOLD, np.nan), score)
                for own, score in zip(recordings, scores, strict=True)
            ]
            for title, scores in found.items()
            if scores is not None
        }

    def _simulated(self) -> Dataset | None:
        """Return the simulated recordings to learn from as well, thinned out. Raises DataError."""
        if not self._options.simulated:
            return None
        require("pyarrow", extra="data", purpose="a dataset")
        parts = [(folder, load(Path(folder))) for folder in self._options.simulated]
        every = OWN["fused"]
        return merged([(folder, training_part(own, every.get(str(own.card.get("job")), 1))) for folder, own in parts])


def _by_setup(scores: Scores) -> list[tuple[str, Scores]]:
    """Return the scores of all recordings, and of each setup where there are several."""
    setups = sorted({own.outputs.setup for own, _, _ in scores})
    parts = [(setup, [each for each in scores if each[0].outputs.setup == setup]) for setup in setups]
    return [(ALL, scores), *parts] if len(parts) > 1 else [(setups[0], scores)]


def _transferable(recordings: Sequence[LabelledRecording], name: str, budget: Budget) -> float:
    """Return the threshold that `lsds calibrate slip` finds on recordings, of which those of an object count as one;
    infinite without any."""
    objects = sorted({own.object for own in recordings})
    if not objects:
        return math.inf
    groups = [_quiet([own for own in recordings if own.object == each], name) for each in objects]
    return transferable(groups, budget)[0]


def _quiet(recordings: Sequence[LabelledRecording], name: str) -> tuple[Floats, Floats]:
    """Return a detector's scores in all frames in which nothing slips: those that move, and those that are still."""
    found: list[list[Floats]] = [[np.empty(0)], [np.empty(0)]]
    for own in recordings:
        frames = scored_frames(own.intervals, own.outputs.moved_px)
        for part, mask in zip(found, (frames.moving, frames.still), strict=True):
            part.append(own.outputs.score[name][mask])
    return np.concatenate(found[0]), np.concatenate(found[1])


def _row(name: str, setup: str, scores: Scores, alarms: float, seed: int) -> Row:
    """Return one row: at the detector's threshold, and at the one with `alarms` false alarms per 100 moving frames."""
    labelled = [own.with_slip(slip) for own, slip, _ in scores]
    counts = sum((counted(each) for each in labelled), Counts())
    late = np.concatenate([onset_errors(each) for each in labelled]) if labelled else np.empty(0)
    late = late[np.isfinite(late)]
    at = _at(scores, _threshold(scores, alarms))
    swept = sum((counted(each) for each in at), Counts())
    objects = [own.object for own, _, _ in scores]
    decided = _intervals([counted(each) for each in labelled], objects, seed)
    low, high = _intervals([counted(each) for each in at], objects, seed)["noticed_share"]
    return {
        "detector": name,
        "setup": setup,
        "found": counts.recall,
        "found_low": decided["recall"][0],
        "found_high": decided["recall"][1],
        "noticed": counts.noticed_share,
        "noticed_low": decided["noticed_share"][0],
        "noticed_high": decided["noticed_share"][1],
        "per_100_moving_low": decided["per_100_moving"][0],
        "per_100_moving_high": decided["per_100_moving"][1],
        "slip_unanswered": counts.unanswered_share,
        "moving_unanswered": counts.moving_unanswered_share,
        "intervals": counts.intervals,
        "per_100_moving": counts.per_100_moving,
        "per_100_still": counts.per_100_still,
        "onset": float(np.median(late)) if len(late) else math.nan,
        "answered": counts.answered / max(counts.frames, 1),
        "at_found": swept.recall,
        "at_noticed": swept.noticed_share,
        "at_low": low,
        "at_high": high,
        "at_still": swept.per_100_still,
    }


def _threshold(scores: Scores, alarms: float) -> float:
    """Return the score that `alarms` of 100 moving, sticking frames exceed."""
    moving = [
        np.nan_to_num(score, nan=-np.inf)[scored_frames(own.intervals, own.outputs.moved_px).moving]
        for own, _, score in scores
    ]
    values = np.concatenate(moving) if moving else np.empty(0)
    return threshold(values, np.empty(0), Budget(alarms)) if len(values) else math.inf


def _at(scores: Scores, least: float) -> list[LabelledOutputs]:
    return [own.with_slip(np.where(np.isfinite(slip), exceeds(score, least), np.nan)) for own, slip, score in scores]


def _intervals(parts: Sequence[Counts], objects: Sequence[str], seed: int) -> dict[str, tuple[float, float]]:
    """Return 95 % intervals of some figures, over objects drawn with replacement."""
    names = sorted(set(objects))
    by_object = [sum((own for own, at in zip(parts, objects, strict=True) if at == name), Counts()) for name in names]
    rng = np.random.default_rng(seed)
    drawn = [
        sum((by_object[k] for k in rng.integers(0, len(names), len(names))), Counts()) for _ in range(_BOOTSTRAP_DRAWS)
    ]
    found = {}
    for figure in ("recall", "noticed_share", "per_100_moving"):
        values = [value for counts in drawn if math.isfinite(value := getattr(counts, figure))]
        low, high = np.quantile(values, (0.025, 0.975)) if values else (math.nan, math.nan)
        found[figure] = float(low), float(high)
    return found


def _curve(scores: Scores) -> list[tuple[float, float]]:
    """Return (false alarms per 100 moving frames, share of intervals noticed) over thresholds."""
    points = []
    for alarms in (0.5, 1, 1.5, 2, 3, 4, 5, 6, 8, 10, 15, 20, 30, 50):
        counts = sum((counted(each) for each in _at(scores, _threshold(scores, alarms))), Counts())
        points.append((counts.per_100_moving, counts.noticed_share))
    return points


def _travel_row(name: str, recordings: Sequence[LabelledRecording]) -> Row:
    errors, answered, frames = [], 0, 0
    for own in recordings:
        slid = own.outputs.slid[name]
        nothing = np.full(own.outputs.count, np.nan)
        errors += travels(LabelledOutputs(own.intervals, nothing, own.outputs.moved_px, slid[:, :2], slid[:, 2]))
        for interval in scored_intervals(own.intervals):
            part = slid[interval.first : interval.last + 1, 0]
            answered, frames = answered + int(np.isfinite(part).sum()), frames + len(part)
    moved = [error for error in errors if math.isfinite(error.off_px) and error.labelled_px > 0]
    turned = [error for error in errors if math.isfinite(error.off_deg)]
    return {
        "estimator": name,
        "slips": len(moved),
        "off_px": _median([error.off_px for error in moved]),
        "off_share": 100 * _median([error.off_px / error.labelled_px for error in moved]),
        "travel_right": _mean([error.off_px <= max(2.0, 0.2 * error.labelled_px) for error in moved]),
        "turns": len(turned),
        "off_deg": _median([abs(error.off_deg) for error in turned]),
        "turn_off_share": 100 * _median([abs(e.off_deg / e.labelled_deg) for e in turned if abs(e.labelled_deg) > 0]),
        "turn_right": _mean([abs(error.off_deg) <= max(3.0, 0.15 * abs(error.labelled_deg)) for error in turned]),
        "answered": answered / max(frames, 1),
    }


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if len(values) else math.nan


def _mean(values: Sequence[bool]) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def _notes(recordings: Sequence[LabelledRecording], alarms: float) -> list[str]:
    slips = sum(len(scored_intervals(own.intervals)) for own in recordings)
    redrawn = int(sum(own.outputs.redrawn.sum() for own in recordings))
    return [
        f"found: share of the frames that slip; noticed: share of {slips} intervals with a report of slip from a frame "
        "before the onset to two after it; /100: false alarms per 100 frames that stick or are free",
        f"'at': at the threshold with {alarms:g} false alarms per 100 moving frames; 95 %: over objects drawn with "
        "replacement; onset: frames late, median; w/o answer: share of frames in which the detector abstains",
        "a frame moves if the fastest tenth of the markers moves by more than half a pixel; unsure and touch, their "
        f"neighbours and the first nine frames are not scored; {redrawn} frames are key frames of a codec",
        f"calibrated: at the threshold that lsds calibrate slip finds on the other scored objects of the setup, for "
        f"{alarms:g} false alarms per 100 moving and {Budget().still:g} per 100 still frames",
    ]
