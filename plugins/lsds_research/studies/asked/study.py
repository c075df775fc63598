"""Study `asked`: what detectors and estimators say in every frame of simulated trials, beside the truth."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from lsds_research.chosen import chosen
from lsds_research.collecting.trials import Job, Trial, trials
from lsds_research.metrics import MOVING_M_S
from lsds_research.studies.asked.options import AskedOptions
from lsds_research.studies.asked.trial import AskedTrial, ask

from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult, StudyTable
from lsds.errors import DataError
from lsds.registry.host import PluginHost
from lsds.support.processes import DIED, spread

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Row = dict[str, Any]

TURNING_RAD_S = 0.05
NORMAL_90 = 1.645
"""Half width of a normal distribution's 90 % interval, in standard deviations."""
_ALL = "all"
_DETECTORS = (
    ("detector", "detector", ""),
    ("object", "object", ""),
    ("found", "found", ".3f"),
    ("per_100_sliding", "/100 beside slides", ".2f"),
    ("per_100_loads", "/100 in load trials", ".2f"),
    ("load_frames", "of", "d"),
    ("answered", "answered", ".2f"),
)
_ESTIMATORS = (
    ("estimator", "estimator", ""),
    ("object", "object", ""),
    ("mae_cm_s", "MAE, cm/s", ".2f"),
    ("zero_mae_cm_s", "always zero", ".2f"),
    ("moving_mae_cm_s", "moving", ".2f"),
    ("moving_zero_cm_s", "always zero", ".2f"),
    ("load_mae_cm_s", "load trials", ".2f"),
    ("coverage", "covered", ".2f"),
    ("moving_coverage", "moving", ".2f"),
    ("angular_error", "turn, %", ".0f"),
    ("turning_coverage", "covered", ".2f"),
    ("answered", "answered", ".2f"),
)


class AskedStudy:
    """A `Study`."""

    def __init__(self, options: AskedOptions, context: BuildContext) -> None:
        self._options, self._seed = options, context.seed

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Run the trials. Raises DataError for an unknown object or where no trial ends, PluginError for a backend."""
        options, host = self._options, PluginHost()
        detectors, estimators = (
            chosen(host, "detector", options.detectors),
            chosen(host, "estimator", options.estimators),
        )
        planned = _planned(options, self._seed)
        found: list[AskedTrial] = []
        failures: dict[str, str] = {}
        work = partial(ask, detectors=detectors, estimators=estimators)
        for done, (trial, result) in enumerate(spread(work, planned, options.jobs), start=1):
            if isinstance(result, AskedTrial):
                found.append(result)
            else:
                failures[trial.recording] = result or DIED
            tick(done, len(planned))
        if not found:
            raise DataError(f"no trial ended; the first: {next(iter(failures.values()))}")
        found.sort(key=lambda each: each.recording)
        parts = [(name, [own for own in found if own.object == name]) for name in sorted({own.object for own in found})]
        parts.append((_ALL, found))
        rows = [_speeds(name, which, part) for name in estimators for which, part in parts]
        alarms = [_slips(name, which, part) for name in detectors for which, part in parts]
        title = f"detectors and estimators asked in {len(found)} simulated trials (simulated)"
        return StudyResult(
            title,
            _ESTIMATORS,
            rows,
            None,
            [
                "moving: frames in which the object truly slides faster than "
                f"{MOVING_M_S * 1e2:g} cm/s; covered: by the 90 % interval that the estimator states; turn: error over "
                "the turn, in frames that turn; where an estimator abstains it counts as saying zero",
                "found: of frames that truly slip; /100: alarms per 100 frames that do not, beside slides, and where "
                "only the load changes",
            ],
            {"failures": failures, "figures_are": "simulated", "seed": self._seed, "detectors": alarms},
            more=[StudyTable(_DETECTORS, alarms)],
            warnings=[f"failed: {name}: {reason}" for name, reason in failures.items()],
        )


def _planned(options: AskedOptions, seed: int) -> list[Trial]:
    """Return slides, turns and changing loads of each object. Raises DataError for an object without a plan."""
    jobs: tuple[Job, ...] = ("severity", "loads")
    return [trial for job in jobs for trial in trials(job, options.objects, seed, quick=options.quick)]


def _slips(name: str, which: str, part: Sequence[AskedTrial]) -> Row:
    said, slip, load = _joined([own.said[name] for own in part], part)
    alarm = np.nan_to_num(said) == 1
    return {
        "detector": name,
        "object": which,
        "found": _mean(alarm[slip == 1]),
        "per_100_sliding": 100 * _mean(alarm[(slip == 0) & ~load]),
        "per_100_loads": 100 * _mean(alarm[(slip == 0) & load]),
        "load_frames": int(((slip == 0) & load).sum()),
        "answered": _mean(np.isfinite(said)),
    }


def _joined(columns: Sequence[Floats], part: Sequence[AskedTrial]) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    slip = np.concatenate([own.slip for own in part])
    load = np.concatenate([np.full(len(own.slip), own.protocol == "loads") for own in part])
    return np.concatenate(columns), slip, load


def _speeds(name: str, which: str, part: Sequence[AskedTrial]) -> Row:
    told, _, load = _joined([own.told[name] for own in part], part)
    velocity = np.concatenate([own.velocity for own in part])
    known = np.isfinite(velocity).all(axis=1)
    told, velocity, load = told[known], velocity[known], load[known]
    answered = np.isfinite(told).all(axis=1)
    true = np.hypot(velocity[:, 0], velocity[:, 1])
    speed, rate = np.nan_to_num(told[:, 5]), np.nan_to_num(told[:, 2])
    moving, turning = true > MOVING_M_S, np.abs(velocity[:, 2]) > TURNING_RAD_S
    off, off_rate = np.abs(speed - true), np.abs(rate - velocity[:, 2])
    covered = off <= NORMAL_90 * told[:, 3]
    covered_rate = off_rate <= NORMAL_90 * told[:, 4]
    return {
        "estimator": name,
        "object": which,
        "mae_cm_s": 100 * _mean(off),
        "zero_mae_cm_s": 100 * _mean(true),
        "moving_mae_cm_s": 100 * _mean(off[moving]),
        "moving_zero_cm_s": 100 * _mean(true[moving]),
        "load_mae_cm_s": 100 * _mean(off[load]),
        "coverage": _mean(covered[answered]),
        "moving_coverage": _mean(covered[answered & moving]),
        "angular_error": 100 * float(off_rate[turning].sum() / np.abs(velocity[turning, 2]).sum())
        if turning.any()
        else math.nan,
        "turning_coverage": _mean(covered_rate[answered & turning]),
        "answered": _mean(answered),
    }


def _mean(values: NDArray[Any]) -> float:
    return float(np.mean(values)) if len(values) else math.nan
