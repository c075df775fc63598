"""Study `certify`: the certificate of a rig."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lsds.cli.output import require_writable_folder
from lsds.clock import NS_PER_S, perf_ns
from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult
from lsds.registry.host import PluginHost
from lsds.session.verdict import Outcome
from lsds_research.certify.duration import seconds_of
from lsds_research.certify.needed_force import NeededForce
from lsds_research.certify.options import CertifyOptions
from lsds_research.certify.plot import plot_certificate
from lsds_research.certify.rig import simulated_rig
from lsds_research.certify.sequential import Estimate, plain, sequential
from lsds_research.certify.zones import Zone, zones
from lsds_research.search.files import save_scenario
from lsds_research.search.fixed_keys import held_fixed
from lsds_research.search.objects import OBJECTS, completed
from lsds_research.search.robustness import NOT_RUN, Limits, run_warnings
from lsds_research.search.scenarios import Scenarios, require_usable, undrawn_notes
from lsds_research.search.space import read_space, values_of

_COLUMNS = (
    ("figure", "of a lift (simulated)", ""),
    ("value", "value", ""),
    ("range", "95 % interval, or range", ""),
)
QUICK_RUNS = 48
"""Number of lifts of a quick certificate, unless configured; chosen."""
QUICK = ("cell.simulated.fidelity=winkler", "task.hold_s=0.5")
NOTICEABLE_M = 1e-3
"""Slip of a lift without an alarm from which on the alarm is missing, m; chosen."""
OVERRUN = 1.1
"""Duration over the budget above which the certificate states it; chosen: the time is to be kept within 10 %."""
SLIP_KEY = "task.max_slip_m"
USUAL_SLIP_MM = 60.0
"""Slip above which a lift counts as a drop if neither rig nor command give a limit, mm; chosen."""
FEW = 5
"""Number of drops, and of holds, below which the lifts that would do are not predicted; chosen."""
PRECISE = 0.5
"""An interval whose half width exceeds this share of the probability, or of that of a hold, is too wide for the budget
to be called enough."""


class CertifyStudy:
    """A `Study`."""

    def __init__(self, options: CertifyOptions, context: BuildContext) -> None:
        self._options, self._seed = options, context.seed
        self._budget_s = seconds_of(options.budget, "--budget")
        counts_lifts = options.quick and not {"runs", "budget"} & options.model_fields_set
        self._runs = QUICK_RUNS if counts_lifts else options.runs
        self._space = read_space(Path(options.space)) if options.space else OBJECTS

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Lift. Raises DataError for an unusable space or file, ConfigError for a rig that is not valid."""
        own = self._options
        settings, replaced = simulated_rig(Path(own.rig) if own.rig else None, PluginHost())
        settings = [*settings, *(QUICK if own.quick else ()), *own.settings]
        slip_mm = own.slip_mm or (None if SLIP_KEY in values_of(settings) else USUAL_SLIP_MM)
        if own.slip_mm:
            settings = [text for text in settings if text.partition("=")[0].strip() != SLIP_KEY]
        limits = Limits(slip_m=None if slip_mm is None else slip_mm * 1e-3, peak=None)
        complete = dict if own.space else completed
        space, fixed = held_fixed(self._space, [*limits.overrides(), *settings])
        idle = require_usable(space, complete, limits, settings, own.space)
        if own.found:
            # Before the lifts, which may take hours.
            require_writable_folder(Path(own.found))
        began_ns = perf_ns()
        draw = (plain if own.plain else sequential)(
            len(space), partial(self._used, began_ns), self._seed, NeededForce(space, complete, settings)
        )
        with Scenarios(limits, settings, own.out, own.jobs, own.cluster) as scenarios:
            answered, estimate = scenarios.answer(
                space,
                draw,
                drop_margin,
                lambda done, asked: tick(*self._progress(done, asked, began_ns)),
                complete=complete,
                room=partial(self._room, began_ns),
            )
        # Of all margins, those of a drop are what was counted.
        rows = [row | {"margin": drop_margin(row)} for row in chain.from_iterable(answered)]
        warnings = run_warnings(rows)
        points = np.array([row["point"] for row in rows])
        # A key without effect names no zone.
        points[:, [axis.key in fixed or axis.key in idle for axis in space]] = 0.5
        dropped = np.array([row["margin"] < 0 for row in rows])
        found = zones(points, dropped, estimate.weights, [len(axis.choices or ()) for axis in space])
        took_s = _since_s(began_ns)
        files = self._saved(rows, settings, limits)
        figures = _figures(rows, estimate)
        notes = [
            *(f"replaced: {text}" for text in replaced),
            *undrawn_notes(fixed, idle),
            "the figures hold for these ranges and a simulated copy of the rig, without a real gel, object or hand",
            *_notes(estimate, own.plain),
            *_undecided(rows, estimate),
            *_within(rows, estimate),
            *self._overrun(took_s, estimate.runs),
            *(f"zone: {_zone_text(zone, space)}" for zone in found),
            *(f"failure: lsds run {file}" for file in files),
        ]
        draw_rows = partial(plot_certificate, rows=rows, estimate=estimate)
        title = f"certificate of {own.rig or 'the simulated cell'}: {estimate.runs} lifts (simulated)"
        return StudyResult(
            title,
            _COLUMNS,
            figures,
            draw_rows,
            notes,
            {
                "probability": {key: getattr(estimate, key) for key in ("estimate", "least", "most", "failed", "runs")},
                "auc": None if math.isnan(estimate.auc) else estimate.auc,
                "zones": [
                    {"ranges": zone.text(space), "rate": zone.rate, "share": zone.share, "failed": zone.failed}
                    for zone in found
                ],
                "runs": [
                    {key: row[key] for key in ("scenario", "outcome", "sentence", "fault", "margin") if key in row}
                    for row in rows
                ],
                "files": [str(file) for file in files],
                "replaced": replaced,
                "took_s": took_s,
                "slip_limit_m": float(values_of([*limits.overrides(), *settings])[SLIP_KEY]),
                "figures_are": "simulated",
                "seed": self._seed,
            },
            warnings=warnings,
        )

    def _used(self, began_ns: int, runs: int) -> float:
        """Return the share of the budget that is used, in the middle of the lifts that would begin now."""
        if self._runs:
            return runs / self._runs
        spent_s = _since_s(began_ns)
        next_s = spent_s * self._options.jobs / runs if runs else 0.0
        return (spent_s + next_s / 2) / self._budget_s

    def _room(self, began_ns: int, runs: int) -> int:
        """Return how many lifts the budget has room for: as many as fit by their time so far, at first one a process.

        Near its end only as many begin as there are processes, so that none is waited for long.
        """
        if self._runs:
            return self._runs - runs
        if self._used(began_ns, runs) >= 1:
            return 0
        spent_s = _since_s(began_ns)
        return max(int((self._budget_s - spent_s) * runs / spent_s) if runs else 0, self._options.jobs)

    def _progress(self, done: int, asked: int, began_ns: int) -> tuple[int, int]:
        if self._runs:
            return done, self._runs
        seconds = max(1, round(self._budget_s))
        return min(round(_since_s(began_ns)), seconds), seconds

    def _overrun(self, took_s: float, runs: int) -> list[str]:
        """Return that it took longer than the budget, if it did: at least one lift is made, and none is cut off."""
        if self._runs or took_s <= OVERRUN * self._budget_s:
            return []
        return [
            f"{runs} lifts and their zones took {took_s:.0f} s instead of {self._budget_s:.0f} s: a lift is not cut off"
        ]

    def _saved(self, rows: Sequence[dict[str, Any]], settings: Sequence[str], limits: Limits) -> list[Path]:
        own = self._options
        if not own.found:
            return []
        failed = sorted(
            (row for row in rows if row["margin"] < 0), key=lambda row: (row["margin"], str(row["scenario"]))
        )
        return [
            save_scenario(
                Path(own.found),
                f"drop-{number}",
                row["scenario"],
                (*limits.overrides(), *settings),
                ["found by lsds study certify (simulated)", str(row.get("sentence", row["outcome"]))],
            )
            for number, row in enumerate(failed[: own.most], start=1)
        ]


def _since_s(began_ns: int) -> float:
    return (perf_ns() - began_ns) / NS_PER_S


def drop_margin(row: dict[str, Any]) -> float:
    """Return the margin of a drop: of hold and slip, and of an end without a name."""
    margins = row["margins"]
    return float(
        min((margins[way] for way in ("holds", "slips little", "named", "ends") if way in margins), default=1.0)
    )


def _figures(rows: Sequence[dict[str, Any]], estimate: Estimate) -> list[dict[str, Any]]:
    """Return the rows of the certificate: each figure over the whole space, by the runs' weights."""
    weights = estimate.weights

    def share(of: Callable[[dict[str, Any]], bool]) -> str:
        return f"{float(weights[[of(row) for row in rows]].sum()):.1%}"

    figures = [
        {
            "figure": "probability of a drop",
            "value": f"{estimate.estimate:.2%}",
            "range": f"{estimate.least:.2%} to {estimate.most:.2%}",
        }
    ]
    for key, figure, unit, scale in (
        ("slip_m", "slip, median", "mm", 1e3),
        ("ratio", "steady grip over needed, median", "", 1.0),
        ("delay_s", "from slip to alarm, median of the lifts that slipped", "ms", 1e3),
    ):
        values = scale * np.array([_figure(row, key) for row in rows])
        known = ~np.isnan(values)
        if not known.any():
            continue
        half, most = (_quantile(values[known], weights[known], q) for q in (0.5, 0.95))
        figures.append(
            {
                "figure": figure,
                "value": f"{half:.3g} {unit}".strip() if math.isfinite(half) else "none",
                "range": f"95 % of lifts below {most:.3g} {unit}".strip()
                if math.isfinite(most)
                else "none in more than 5 % of them",
            }
        )
    invalid_drops = share(lambda row: _is_invalid(row) and row["margin"] < 0)
    figures += [
        {"figure": "stopped with a reason", "value": share(lambda row: row["outcome"] == "fault"), "range": ""},
        {
            "figure": "outside the model's validity",
            "value": share(_is_invalid),
            "range": f"dropped: {invalid_drops}; the rest counts as held",
        },
    ]
    return figures


def _figure(row: dict[str, Any], key: str) -> float:
    """Return a figure of a lift, NaN if it has none. The alarm about a slip that was never noticed comes never."""
    value = row.get(key)
    if key == "delay_s" and value is None and (row.get("slip_m") or 0.0) > NOTICEABLE_M:
        return math.inf
    return math.nan if value is None else float(value)


def _is_invalid(row: dict[str, Any]) -> bool:
    return bool(row.get("invalid", row["outcome"] == Outcome.OUTSIDE))


def _quantile(values: NDArray[np.float64], weights: NDArray[np.float64], q: float) -> float:
    """Return a quantile of weighted values: the first whose cumulated weight reaches the share q."""
    order = np.argsort(values, kind="stable")
    cumulated = np.cumsum(weights[order])
    return float(values[order][int(np.searchsorted(cumulated, q * cumulated[-1]))])


def _notes(estimate: Estimate, is_plain: bool) -> list[str]:
    notes = [
        f"{estimate.failed} of {estimate.runs} lifts dropped, "
        f"{'drawn evenly' if is_plain else 'spent where the answer was least certain'}"
        + ("" if math.isnan(estimate.auc) else f"; a forest ranks unseen lifts with AUC {estimate.auc:.2f}")
    ]
    half = (estimate.most - estimate.least) / 2
    if not estimate.failed:
        notes.append(
            f"no lift dropped: the probability is below {estimate.most:.1%}; a longer budget lowers this bound"
        )
    elif estimate.failed == estimate.runs:
        notes.append(
            f"every lift dropped: the probability is above {estimate.least:.1%}; a longer budget raises this bound"
        )
    elif half > PRECISE * (rarer := min(estimate.estimate, 1 - estimate.estimate)):
        needed = estimate.runs * (half / (PRECISE * rarer)) ** 2
        few = min(estimate.failed, estimate.runs - estimate.failed) < FEW
        notes.append(
            "the budget is too small: the interval is wider than the probability itself, or than that of a hold"
            + ("" if few else f"; about {needed:.0f} lifts would do")
        )
    return notes


def _undecided(rows: Sequence[dict[str, Any]], estimate: Estimate) -> list[str]:
    """Return what lifts that show nothing, stopped or outside the model, could add to the probability."""
    shows_nothing = [row["outcome"] in ("fault", NOT_RUN, Outcome.OUTSIDE) and drop_margin(row) >= 0 for row in rows]
    share = float(estimate.weights[shows_nothing].sum())
    if not share:
        return []
    return [
        f"{share:.1%} of the lifts were stopped or are outside the model and count as not dropped; if each of them "
        f"were a drop, the probability would be {estimate.estimate + share:.1%}"
    ]


def _within(rows: Sequence[dict[str, Any]], estimate: Estimate) -> list[str]:
    """Return the probability of a drop among the lifts within the model's validity, nothing if all are."""
    valid = np.array([not _is_invalid(row) for row in rows])
    dropped = np.array([row["margin"] < 0 for row in rows])
    share = float(estimate.weights[valid].sum())
    if valid.all() or not share:
        return []
    rate = float(estimate.weights[valid & dropped].sum()) / share
    return [
        f"within the model's validity {np.count_nonzero(valid & dropped)} of {np.count_nonzero(valid)} lifts dropped, "
        f"{rate:.1%} of that part of the space"
    ]


def _zone_text(zone: Zone, space: Sequence[Any]) -> str:
    return f"{zone.text(space)}: {zone.failed} of {zone.runs} lifts dropped ({zone.share:.0%} of the space)"
