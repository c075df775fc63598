"""Study `incipient-slip`: real recordings, trained on some objects and tested on others, compared with controls."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult
from lsds_research.clips import model as clips_model
from lsds_research.clips.features import CLIP_FRAMES, CUTS
from lsds_research.incipient.causal import Causal, Curve, causal, fewer
from lsds_research.incipient.folds import (
    Fit,
    Scored,
    cross_validated,
    fold_count,
    majority_rule,
    permuted,
    require_both,
    scored,
    threshold_rule,
    trained_elsewhere,
)
from lsds_research.incipient.index import read_index
from lsds_research.incipient.load import default_cache, load
from lsds_research.incipient.models import applied, clip_model_scores
from lsds_research.incipient.options import IncipientOptions
from lsds_research.incipient.table import Videos, videos_of
from lsds_research.learners.clip_model import clip_model, exported
from lsds_research.metrics import Interval

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.datasets import Dataset

    Floats = NDArray[np.float64]
    Tick = Callable[[int, int], None]

_COLUMNS = (
    ("model", "model", ""),
    ("unit", "of each", ""),
    ("auc", "AUC", ".3f"),
    ("auc_low", "95 %", ".3f"),
    ("auc_high", "", ".3f"),
    ("auc_spread", "sd", ".3f"),
    ("accuracy", "accuracy", ".3f"),
    ("accuracy_low", "95 %", ".3f"),
    ("accuracy_high", "", ".3f"),
    ("tested", "tested on", ""),
)
_BY_OBJECT, _ALL = "unseen objects", "all here"
_CLIPS = sum(times for _, times in CUTS)
FEW_OBJECTS = 12
"""Number of objects up to which a note states that they are few to train on; chosen."""
_READING = 400
"""Steps of progress for reading, of a thousand in total."""


class IncipientStudy:
    """Reads the recordings, then scores every model and every control on the same folds."""

    def __init__(self, options: IncipientOptions, context: BuildContext) -> None:
        self._options = options
        self._seed = context.seed

    def run(self, tick: Tick) -> StudyResult:
        """Measure. Raises DataError for an unusable folder, ModelError for an unusable model."""
        options = self._options
        if options.train:
            read_index(Path(options.train))  # Report errors of the folder before anything is computed.
        data = self._load(Path(options.path), tick)
        videos = videos_of(data)
        elsewhere = videos_of(self._load(Path(options.train), tick)) if options.train else None
        table, notes = _Table(videos, self._seed), _notes(data, videos)
        # Score the finished models first, so that an error in one is reported before anything is fitted.
        simulated = applied(options.model, options.slower, videos, notes)
        self._fitted_before(table, elsewhere)
        courses: Causal | None = None
        if _both(videos):
            steps = _Steps(tick, options.repeats * (6 * fold_count(videos.object)) + 6 * fold_count(videos.object))
            self._cross_validate(table, steps)
            courses = causal(videos, options.trees, options.jobs, self._seed, steps)
            table.rows += courses.rows
            notes += courses.notes
        if options.save_model:
            self._save(Path(options.save_model), videos, Path(options.path).name)
        for number, row in enumerate(simulated):
            table.add(*row, tested=_ALL, drawn=number == 0 or options.model == "shipped")
        if not table.rows:
            require_both(videos.slip, videos.object)
        details = {
            "clip_frames": CLIP_FRAMES,
            "folds": fold_count(videos.object),
            "repeats": options.repeats,
            "seed": self._seed,
            "failures": data.card["failures"],
            "online": None if courses is None else courses.details(),
            "prevalence": table.prevalence,
            "figures_are": "measured",
        }
        rows = [_row(row, tested) for row, tested in table.rows]
        warnings = [f"passed over: {reason}" for reason in data.card["failures"].values()]
        if options.save_model:
            notes.append(f"clip model: {options.save_model}")
        title = f"real recordings, {len(np.unique(videos.recording))} of {len(np.unique(videos.object))} objects"
        return StudyResult(title, _COLUMNS, rows, partial(_draw, table, courses), notes, details, warnings=warnings)

    def _fitted_before(self, table: _Table, elsewhere: Videos | None) -> None:
        videos, options = table.videos, self._options
        shipped = clip_model_scores(videos)
        if shipped is not None:
            name, probability, unseen = shipped
            objects = len(np.unique(videos.object[unseen]))
            table.add(name, probability, tested=_ALL if unseen.all() else f"{objects} objects it lacks", keep=unseen)
        if elsewhere is not None:
            fit = clip_model(options.trees, jobs=options.jobs)
            probability, own = trained_elsewhere(fit, elsewhere, videos, self._seed)
            words = f"trained on {len(np.unique(elsewhere.object[own]))} objects of {Path(options.train).name}"
            table.add("whole clips, " + words, probability, tested=_ALL)

    def _save(self, path: Path, videos: Videos, trained_on: str) -> None:
        onnx, middle = exported(videos.clip, videos.slip, self._seed, self._options.trees)
        clips_model.save(path, onnx, middle, [str(name) for name in np.unique(videos.object)], trained_on)

    def _load(self, folder: Path, tick: Tick) -> Dataset:
        cache = self._options.cache
        place = None if cache == "none" else Path(cache) if cache else default_cache()
        return load(folder, self._options.jobs, place, lambda done, whole: tick(_READING * done // whole, 1000))

    def _cross_validate(self, table: _Table, steps: _Steps) -> None:
        videos, options = table.videos, self._options
        forest = clip_model(options.trees, jobs=options.jobs)
        small = clip_model(fewer(options.trees), jobs=options.jobs)
        seeds = [self._seed + k for k in range(options.repeats)]

        def out_of_fold(fit: Fit, x: Floats, slips: list[NDArray[np.intp]], tick: Callable[[], object]) -> Floats:
            runs = zip(slips, seeds, strict=True)
            return np.array([cross_validated(fit, x, slip, videos.object, seed, tick) for slip, seed in runs])

        true = [videos.slip] * len(seeds)
        whole = out_of_fold(forest, videos.clip, true, steps)
        table.add(f"whole recording: mean of {_CLIPS} clips of {CLIP_FRAMES} frames", whole, videos=True)
        table.add(f"one clip of {CLIP_FRAMES} frames at a random place", out_of_fold(small, videos.window, true, steps))
        table.add(
            "one number: two-frame maximum of v_net", out_of_fold(threshold_rule, videos.v_net[:, None], true, _no)
        )
        table.add("one number: mean speed while moving", out_of_fold(threshold_rule, videos.speed[:, None], true, _no))
        table.add("majority", out_of_fold(majority_rule, videos.clip, true, _no), drawn=False)
        # A constant prediction has no ROC curve; different majorities of the folds must not count as information.
        table.rows[-1] = (dataclasses.replace(table.rows[-1][0], auc=Interval(0.5, 0.5, 0.5)), _BY_OBJECT)
        dealt = [permuted(videos.slip, videos.recording, seed) for seed in seeds]
        table.add("labels shuffled by recording", out_of_fold(small, videos.clip, dealt, steps), slip=np.array(dealt))
        table.add("nuisances: dots, brightness, kept", out_of_fold(small, videos.nuisance, true, steps))
        table.add("first frame alone: nothing has moved", out_of_fold(small, videos.first, true, steps))
        table.add("last frame alone", out_of_fold(small, videos.last, true, steps))
        table.add("length alone (no model here sees it)", out_of_fold(small, videos.frames[:, None], true, _no))
        table.add("file alone: frames, bytes, number", out_of_fold(small, videos.file, true, _no))
        self._across(table, forest)

    def _across(self, table: _Table, fit: Fit) -> None:
        """Add the scores of a model of one setup on the other."""
        videos = table.videos
        for whole, words in ((False, "whole pad, trained on zoomed"), (True, "zoomed pad, trained on whole")):
            own = videos.whole_pad == whole
            known = np.unique(videos.slip[own])
            if len(known) == 2 and len(np.unique(videos.slip[~own])) == 2:
                probability = fit(videos.clip[own], videos.slip[own], self._seed)(videos.clip)
                table.add("across setups, whole recording", probability, keep=~own, tested=words)


class _Steps:
    """Converts finished steps of work to progress."""

    def __init__(self, tick: Tick, whole: int) -> None:
        self._tick, self._whole, self._done = tick, whole, 0

    def __call__(self) -> None:
        self._done += 1
        self._tick(_READING + (999 - _READING) * min(self._done, self._whole) // self._whole, 1000)


def _no() -> None:
    """Do nothing: for work that is too fast to count."""


class _Table:
    """The rows of the table in their order, and the curves of the picture."""

    def __init__(self, videos: Videos, seed: int) -> None:
        self.videos = videos
        self.rows: list[tuple[Scored, str]] = []
        self.curves: list[Curve] = []
        self._seed = seed

    @property
    def prevalence(self) -> float:
        """Share of the recordings that slip."""
        _, first = np.unique(self.videos.recording, return_index=True)
        return float(np.mean(self.videos.slip[first]))

    def add(
        self,
        name: str,
        probability: Floats,
        threshold: float = 0.5,
        *,
        videos: bool = False,
        slip: NDArray[np.intp] | None = None,
        tested: str = _BY_OBJECT,
        keep: NDArray[np.bool_] | None = None,
        drawn: bool = True,
    ) -> None:
        """Score probabilities (repeats, n) or (n,), of all videos or those to `keep`; `videos` adds a row that scores
        each camera separately."""
        chosen = np.ones(len(self.videos), bool) if keep is None else keep
        true = (self.videos.slip if slip is None else slip)[..., chosen]
        probability, recordings = probability[..., chosen], self.videos.recording[chosen]
        for alone in (False, True)[: 1 + videos]:
            row = scored(name, recordings, true, probability, threshold, per_video=alone, seed=self._seed)
            self.rows.append((row, tested))
        area = self.rows[-1 - videos][0].auc.value
        if drawn:
            self.curves.append(
                Curve(f"{area:.3f}  {name}", recordings, np.atleast_2d(true)[0], np.atleast_2d(probability)[0])
            )


def _both(videos: Videos) -> bool:
    return all(len(np.unique(videos.object[videos.slip == label])) >= 2 for label in (0, 1))


def _notes(data: Dataset, videos: Videos) -> list[str]:
    listed = data.card["videos"]
    doubtful = {video["recording"] for video in listed.values() if video["conflict"]}
    notes = [
        f"every clip has {CLIP_FRAMES} frames, whatever the recording's length; folds are by object; intervals are "
        "over recordings drawn with replacement"
    ]
    if doubtful:
        notes.append(f"left out, label in doubt: {', '.join(sorted(doubtful))}")
    short = sorted({str(r) for r in videos.recording[videos.frames < CLIP_FRAMES]})
    if short:
        notes.append(f"shorter than a clip, frames repeated: {', '.join(short)}")
    if "not_kept" in data.card:
        notes.append(f"the cache could not be written: {data.card['not_kept']}")
    if data.card["failures"]:
        notes.append(f"{len(data.card['failures'])} of {len(listed)} videos could not be used, see stderr")
    objects = len(np.unique(videos.object))
    if objects <= FEW_OBJECTS:
        notes.append(
            f"{objects} objects are few to train on: a model fitted on others (shipped, or --train) is more reliable"
        )
    return notes


def _row(row: Scored, tested: str) -> dict[str, Any]:
    return {
        "model": row.name,
        "unit": row.unit,
        "auc": row.auc.value,
        "auc_low": row.auc.low,
        "auc_high": row.auc.high,
        "auc_spread": row.spread,
        "accuracy": row.accuracy.value,
        "accuracy_low": row.accuracy.low,
        "accuracy_high": row.accuracy.high,
        "tested": tested,
    }


def _draw(table: _Table, courses: Causal | None, path: Path) -> None:
    from lsds_research.incipient.plot import draw

    draw(path, table.videos, table.curves, courses)
