"""Study `loop`: whole configurations, computing time of a frame against slip and steady grip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult
from lsds.errors import DataError
from lsds.registry.host import PluginHost
from lsds.session.parts import loaded
from lsds_research.run_store import run_and_store
from lsds_research.studies.grip.lift import lift
from lsds_research.studies.loop.lifts import Configuration, beaten_by, configurations, mark_front, planned, summarized
from lsds_research.studies.loop.options import LoopOptions
from lsds_research.studies.loop.plot import plot_loop
from lsds_research.study_backends import backend_names, with_own_defaults

if TYPE_CHECKING:
    Row = dict[str, Any]

_COLUMNS = (
    ("configuration", "tracker detector+estimator controller", ""),
    ("runs", "runs", "d"),
    ("held", "held", ".2f"),
    ("frame_us", "image to command, us, mean", ".0f"),
    ("cost", "CPU s per simulated s", ".2f"),
    ("slip_mm", "slip, mm", ".2f"),
    ("steady", "steady/needed", ".2f"),
    ("steady_all", "of all", ".2f"),
    ("front", "front", ""),
)


class LoopStudy:
    """A `Study`."""

    def __init__(self, options: LoopOptions, context: BuildContext) -> None:
        self._options, self._seed = options, context.seed

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Run the lifts. Raises DataError for an unknown object, PluginError for an unknown backend."""
        rows, runs, failures = measured(self._options, self._seed, tick)
        rows.sort(key=lambda row: row["frame_us"])
        return StudyResult(
            "whole configurations: computing time, slip and grip (slip and grip simulated)",
            _COLUMNS,
            [{**row, "front": "*" if row["front"] else ""} for row in rows],
            partial(plot_loop, rows=rows),
            [
                "slip, steady: medians over the lifts that slipped; of all: over all lifts; front: Pareto front",
                *default_note(rows),
            ],
            {"configurations": rows, "runs": runs, "failures": failures, "figures_are": "simulated"},
            warnings=[f"failed: {name}: {reason}" for name, reason in failures.items()],
        )


def default_configuration() -> Configuration:
    """Return the configuration of a run without a config."""
    config = loaded(None, [])
    kinds = ("tracker", "detector", "estimator", "controller")
    names = {kind: str(getattr(config, kind).backend) for kind in kinds}
    return Configuration(**names, budget_ms=config.tactile.budget_ms or 0.0)


def default_note(rows: Sequence[Row]) -> list[str]:
    """Return whether the default is on the front, or what beats it; nothing if it was not measured."""
    found = next((row for row in rows if row["default"]), None)
    if found is None:
        return []
    name = f"the default, {found['configuration']}, is"
    if found["held"] < 1:
        return [f"{name} not on the front: it dropped some"]
    if (better := beaten_by(found, rows)) is None:
        return [f"{name} on the front"]
    return [f"{name} not on the front: {better['configuration']} is at least as good in everything"]


def own_options(host: PluginHost, options: LoopOptions) -> LoopOptions:
    """Return the options, with "lsds:name" for each default backend whose name another plugin claims too."""
    options = with_own_defaults(host, options, {"trackers": "tracker", "controllers": "controller"})
    if "pairs" in options.model_fields_set:
        return options
    pairs = [each.partition("+") for each in options.pairs]
    named = [f"{host.own('detector', eye)}+{host.own('estimator', gauge)}" for eye, _, gauge in pairs]
    return options.model_copy(update={"pairs": named})


def measured(
    options: LoopOptions, seed: int, tick: Callable[[int, int], None]
) -> tuple[list[Row], list[Row], dict[str, str]]:
    """Return a row for each configuration, one for each lift, and the lifts that failed. Raises as `run` does."""
    host = PluginHost()
    options = own_options(host, options)
    for each in configurations(options):
        for kind, name in each.backends().items():
            backend_names(host, kind, [name])
    lifts = list(planned(options, seed))
    known, failures = run_and_store(lift, [what for _, what in lifts], options.out, options.jobs, "", tick)
    if any("frame_mean_us" not in row for row in known.values()):
        raise DataError(f"{options.out}: holds lifts of an earlier version, without mean times (choose another file)")
    rows: list[Row] = []
    default = default_configuration()
    for each in configurations(options):
        own = [known[what.key] for of, what in lifts if of == each and what.key in known]
        if own:
            rows.append(summarized(each, own) | {"default": each == default})
    if not rows:
        raise DataError(f"no lift could be run; the first: {next(iter(failures.values()))}")
    mark_front(rows)
    return rows, [*known.values()], failures
