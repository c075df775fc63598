"""Study `grip`: every controller on objects, first squeezes, speeds, frictions, changes of load and seeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.config import load_config
from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult
from lsds.errors import DataError
from lsds.registry.host import PluginHost
from lsds.session.verdict import Outcome
from lsds_research.campaign_options import thinned
from lsds_research.collecting.objects import PLANS, check_objects
from lsds_research.idle_keys import require_free, require_objects
from lsds_research.run_store import run_and_store
from lsds_research.studies.grip import sensitivity
from lsds_research.studies.grip.lift import OBJECT_KEY, OFF, Lift, lift, weight_n
from lsds_research.studies.grip.options import GripOptions
from lsds_research.studies.grip.plot import plot_grip
from lsds_research.studies.grip.random_objects import DEVELOPMENT, FIRM_SQUEEZES_MM, drawn
from lsds_research.study_backends import backend_names

if TYPE_CHECKING:
    Row = dict[str, Any]

MET_MM = 0.05
"""A run reached the friction limit if the object slipped by more than this (mm)."""
GREW = 1.1
"""Ratio of peak to first grip above which a grip has grown; chosen."""
EXPLAINED = (
    "needed: minimum normal force per finger that carries the object; slip, arrest, peak, steady: medians and 95 % "
    f"quantiles over the runs that slipped by more than {MET_MM} mm; grown where it held: share of the other runs "
    "whose grip grew by more than a tenth; closings without slip: per run; change held fast: share of the runs that "
    "did not slip when the load changed; needed force of objects that turn: by weight alone; held: in the grip at the "
    "end; verdict held: also within task.max_slip_m, task.max_grip_ratio and the model's validity, as lsds run judges"
)
_COLUMNS = (
    ("controller", "controller", ""),
    ("change", "change", ""),
    ("runs", "runs", "d"),
    ("held", "held", ".3f"),
    ("met", "slipped", "d"),
    ("slip_mm", "slip, mm", ".1f"),
    ("slip_95_mm", "95 %", ".1f"),
    ("arrest_s", "arrest, s", ".2f"),
    ("peak", "peak/needed", ".2f"),
    ("peak_95", "95 %", ".2f"),
    ("steady", "steady/needed", ".2f"),
    ("steady_95", "95 %", ".2f"),
    ("grew", "grown where it held", ".3f"),
    ("steady_held", "steady there", ".2f"),
    ("false_closings", "closings without slip", ".2f"),
    ("change_kept", "change held fast", ".2f"),
    ("change_90_mm", "its slip, 90 %", ".1f"),
    ("turned_90", "turned, deg, 90 %", ".1f"),
    ("crushed", "crushed", ".3f"),
    ("sound", "verdict held", ".3f"),
    ("outside", "outside validity", ".3f"),
)


VARIED = {
    "seed": "--seed and --seeds",
    "controller.backend": "--controller",
    OBJECT_KEY: "--object",
    "cell.simulated.friction_scale": "--friction",
    "task.first_squeeze_m": "--squeeze-mm",
    "task.lift_speed_m_s": "--speed",
}
"""Config keys that the study varies, with the options that do so."""


class GripStudy:
    """A `Study`."""

    def __init__(self, options: GripOptions, context: BuildContext) -> None:
        self._options, self._seed = options, context.seed

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Run the lifts. Raises ConfigError for an unknown object or cell, PluginError for an unknown controller."""
        options = self._options
        require_free(options.settings, VARIED)
        require_objects(load_config(None, options.settings), [OBJECT_KEY])
        varied = _variants(options)
        texts = [text for _, _, text in varied]
        if options.random:
            found, failures = _of_random_objects(options, texts, tick)
        else:
            planned = _with_variants(_planned(options, self._seed), texts)
            found, failures = run_and_store(lift, planned, options.out, options.jobs, options.cluster, tick)
        # Of random objects, the lifts with a firm grip only decide which ones count.
        rows = [row for row in found.values() if not options.random or row["controller"] != OFF]
        if not rows and not failures:
            raise DataError(f"a firm grip holds none of these {options.random} objects: draw more")
        if not rows:
            raise DataError(f"no lift could be run; the first: {next(iter(failures.values()))}")
        rows.sort(key=lambda row: tuple(str(row[name]) for name in ("controller", "change", "object", "squeeze_mm")))
        groups = sorted({(row["controller"], row["change"]) for row in rows})
        table = [{"controller": who, "change": change, **_summary(_of(rows, who, change))} for who, change in groups]
        if varied:
            table = sensitivity.table([row for row in rows if row["controller"] != OFF], varied, _summary)
        return StudyResult(
            _title(options, rows),
            sensitivity.COLUMNS if varied else _COLUMNS,
            table,
            None if varied else partial(plot_grip, rows=rows),
            [EXPLAINED, *_within_validity(found, rows, options), *([sensitivity.EXPLAINED] if varied else [])],
            {"runs": rows, "failures": failures, "figures_are": "simulated", "seed": self._seed},
            warnings=[f"failed: {name}: {reason}" for name, reason in failures.items()],
        )


def _planned(options: GripOptions, seed: int) -> list[Lift]:
    """Return the runs. Raises ConfigError for an unknown object, PluginError for an unknown controller."""
    check_objects(options.objects)
    host = PluginHost()
    named = [name for name in options.controllers if name != OFF]
    controllers = backend_names(host, "controller", named) if named or not options.controllers else []
    if OFF in options.controllers or not options.controllers:
        controllers = [*controllers, OFF]
    objects = thinned(options, "objects", 3)
    speeds = options.speeds_m_s[len(options.speeds_m_s) // 2 :][:1] if options.quick else options.speeds_m_s
    cases = product(
        controllers, objects, options.squeezes_mm, speeds, options.frictions, options.changes, range(options.seeds)
    )
    return [
        Lift(
            who,
            name,
            squeeze,
            speed,
            friction,
            change,
            seed + 1 + own,
            weight_n(name),
            options.probe,
            round(options.fragile * PLANS[name].needed_n, 3) if options.fragile else None,
            tuple(options.settings),
        )
        for who, name, squeeze, speed, friction, change, own in cases
    ]


def _of_random_objects(
    options: GripOptions, texts: Sequence[str], tick: Callable[[int, int], None]
) -> tuple[dict[str, Row], dict[str, str]]:
    """Return the lifts and the failures of random objects, as `run_and_store`. Raises PluginError.

    A firm grip first: its squeezes grow until one holds, and the controllers lift only what one has held.
    """
    named = [name for name in options.controllers if name != OFF]
    controllers = backend_names(PluginHost(), "controller", named)
    settings = tuple(options.settings)
    objects = [drawn(options.draw, index) for index in range(options.random)]
    found: dict[str, Row] = {}
    failures: dict[str, str] = {}

    def run(lifts: Sequence[Lift], more: int) -> None:
        begun = len(found) + len(failures)
        rows, failed = run_and_store(
            lift,
            lifts,
            options.out,
            options.jobs,
            options.cluster,
            lambda done, total: tick(begun + done, begun + total + more),
        )
        found.update(rows)
        failures.update(failed)

    held: set[str] = set()
    for squeeze_mm in FIRM_SQUEEZES_MM:
        untried = [each.lift(OFF, squeeze_mm, settings) for each in objects if each.name not in held]
        run(untried, len(objects) * len(controllers) * (1 + len(texts)))
        held = {row["object"] for row in found.values() if row["held"]}
    holdable = [each for each in objects if each.name in held]
    lifts = [each.lift(who, each.squeeze_mm, settings) for each in holdable for who in controllers]
    run(_with_variants(lifts, texts), 0)
    return found, failures


def _with_variants(planned: list[Lift], texts: Sequence[str]) -> list[Lift]:
    """Return the lifts, and after them those of the controllers again with each override."""
    plain = [what for what in planned if what.controller != OFF]
    return [*planned, *(what for text in texts for what in sensitivity.varied(plain, text))]


def _within_validity(found: Mapping[str, Row], rows: Sequence[Row], options: GripOptions) -> list[str]:
    """Return how many of the random objects are held that a firm grip holds within the model's validity."""
    if not options.random:
        return []
    firm = [row for row in found.values() if row["controller"] == OFF and row["held"]]
    valid = {row["object"] for row in firm if row["outcome"] != Outcome.OUTSIDE}
    counts = []
    for who in sorted({row["controller"] for row in rows}):
        own = [row for row in rows if row["controller"] == who and row["object"] in valid]
        counts.append(f"{who} in {sum(row['held'] for row in own)} of {len(own)} lifts")
    return [f"objects that a firm grip holds within the model's validity: held by {', '.join(counts)}"]


def _title(options: GripOptions, rows: Sequence[Row]) -> str:
    count = len({row["object"] for row in rows})
    if not options.random:
        return f"grip of {count} unknown objects (simulated)"
    use = "development" if options.draw in DEVELOPMENT else "evaluation"
    return f"grip of {count} random objects that a firm grip holds, draw {options.draw} for {use} (simulated)"


def _of(rows: Sequence[Row], controller: str, change: str) -> list[Row]:
    return [row for row in rows if (row["controller"], row["change"]) == (controller, change)]


def _variants(options: GripOptions) -> list[tuple[str, float, str]]:
    """Return the variants of a sensitivity study, none for another one. Raises DataError without one controller."""
    if not options.sensitivity:
        return []
    named = [name for name in options.controllers if name != OFF]
    if len(named) != 1:
        raise DataError("a sensitivity study varies the parameters of one controller: give --controller NAME once")
    return sensitivity.variants(named[0], options.settings)


def _summary(rows: Sequence[Row]) -> Row:
    met = [row for row in rows if row["slip_mm"] > MET_MM]
    other = [row for row in rows if row["slip_mm"] <= MET_MM and row["held"]]
    grew = [row["peak_over_needed"] > GREW * row["first_over_needed"] for row in other]
    return {
        "runs": len(rows),
        "held": float(np.mean([row["held"] for row in rows])),
        "met": len(met),
        "slip_mm": _quantile(met, "slip_mm", 0.5),
        "slip_95_mm": _quantile(met, "slip_mm", 0.95),
        "arrest_s": _quantile(met, "arrest_s", 0.5),
        "peak": _quantile(met, "peak_over_needed", 0.5),
        "peak_95": _quantile(met, "peak_over_needed", 0.95),
        "steady": _quantile(met, "steady_over_needed", 0.5),
        "steady_95": _quantile(met, "steady_over_needed", 0.95),
        "grew": float(np.mean(grew)) if grew else None,
        "steady_held": _quantile(other, "steady_over_needed", 0.5),
        "false_closings": float(np.mean([row["closings_without_slip"] for row in rows])),
        "change_kept": _mean([row["change_slip_mm"] <= MET_MM for row in rows if row["change_slip_mm"] is not None]),
        "change_90_mm": _quantile(rows, "change_slip_mm", 0.9),
        "turned_90": _quantile([row for row in rows if row["change"] == "turn"], "turned_deg", 0.9),
        "sound": float(np.mean([row["outcome"] == Outcome.HELD for row in rows])),
        "outside": float(np.mean([row["outcome"] == Outcome.OUTSIDE for row in rows])),
        "crushed": _mean([row["crushed"] for row in rows if row["crushed"] is not None]),
    }


def _mean(values: Sequence[bool]) -> float | None:
    return float(np.mean(values)) if values else None


def _quantile(rows: Sequence[Row], name: str, share: float) -> float | None:
    values = [row[name] for row in rows if row[name] is not None]
    return float(np.quantile(values, share)) if values else None
