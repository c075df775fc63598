"""Study `faults`: fault x severity x moment x seed, each next to the same run without the fault."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import combinations, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.config import load_config
from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult, StudyTable
from lsds.errors import DataError, MissingExtra
from lsds.registry.backends import OWN_DISTRIBUTION, OWN_PREFIX
from lsds.registry.host import PluginHost
from lsds.session.verdict import Outcome
from lsds_research.campaign_options import quickened
from lsds_research.idle_keys import require_free
from lsds_research.job_of_a_run import require_end
from lsds_research.run_store import run_and_store
from lsds_research.search.split import exact_bounds
from lsds_research.studies.faults.case import OPENED_BY_FAULT_M, Case, run_case
from lsds_research.studies.faults.options import FaultsOptions
from lsds_research.studies.faults.paired import holm, mcnemar, sign_test
from lsds_research.studies.faults.plot import plot_faults
from lsds_research.study_backends import backend_names, with_own_defaults

if TYPE_CHECKING:
    from lsds.config import RigConfig

    Row = dict[str, Any]

SQUEEZED = 2.0
"""Ratio of peak force to that of the run without the fault above which a run counts as squeezed."""
OUTSIDE = 0.05
"""Probability that an upper bound is wrong."""
EXPLAINED = (
    "stopped: ended by an error that the project raises on purpose; unnamed: ended by another error; harmless: the "
    "same outcome as the run without the fault; missed: another outcome, and no error; opened: fingers that held "
    "something opened by a millimetre more than without it; squeezed: whatever the end, with more than "
    f"{SQUEEZED:g} times the peak force; safe: time from the fault to the stop"
)
_COLUMNS = (
    ("fault", "fault", ""),
    ("runs", "runs", "d"),
    ("gels", "{unit}", "d"),
    ("stopped", "stopped", ".2f"),
    ("harmless", "harmless", ".2f"),
    ("missed", "missed", ".2f"),
    ("missed_gels", "{unit} with missed", "d"),
    ("missed_most", "{unit}, at most", ".2f"),
    ("unnamed", "unnamed errors", "d"),
    ("opened", "opened", "d"),
    ("squeezed", "squeezed", ".2f"),
    ("safe_s", "safe after, s", ".2f"),
    ("safe_max_s", "at most", ".2f"),
    ("errors", "errors", ""),
)
_COMPARED = (
    ("pair", "pair", ""),
    ("runs", "runs", "d"),
    ("missed", "missed runs", ""),
    ("gels", "{unit}", "d"),
    ("worse", "{unit} with more missed", ""),
    ("p", "p over {unit} (Holm)", ".3f"),
    ("p_runs", "McNemar over runs (Holm)", ".3f"),
)
COMPARED = (
    "p over {unit}: exact sign test on the difference in the number of missed runs of each of the {unit}; "
    "McNemar over runs treats runs of the same {unit} as independent, so its p can be too small"
)


VARIED = {
    "seed": "--seed and --seeds",
    "controller.backend": "--controller",
    "detector.backend": "--detector",
    "faults": "--fault",
}
"""Config keys that the study varies, with the options that do so."""
QUICK: dict[str, Any] = {"severities": [3, 5], "moments": ["lift", "slip"], "seeds": 1}
"""Options of `--quick`, unless they are given."""


class FaultsStudy:
    """A `Study`."""

    def __init__(self, options: FaultsOptions, context: BuildContext) -> None:
        self._options, self._seed = options, context.seed

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Run the lifts. Raises DataError if none could be run, PluginError for an unknown fault or controller."""
        options = self._options
        planned = _planned(options, self._seed)
        found, failures = run_and_store(run_case, planned, options.out, options.jobs, options.cluster, tick)
        rows = [*found.values()]
        alone = {row["pair"]: row for row in rows if not row["fault"]}
        judged = [_judged(row, alone[row["pair"]]) for row in rows if row["fault"] and row["pair"] in alone]
        if not judged:
            raise DataError(f"no run could be compared; the first failure: {next(iter(failures.values()), 'none')}")
        judged, idle = [row for row in judged if row["verdict"]], [row for row in judged if not row["verdict"]]
        if not judged:
            raise DataError("no run could be judged: none of the faults began, or nothing was held without them")
        judged.sort(key=lambda row: (row["fault"], row["severity"], row["moment"], row["pair"]))
        table = [_summary(name, _of(judged, "fault", name)) for name in sorted({row["fault"] for row in judged})]
        table.append(_summary("all", judged))
        unit = _unit(options)
        notes = [EXPLAINED, _bounds_note(table[-1], unit), _arm_note(judged), *_others_note([*idle, *alone.values()])]
        compared = _compared(judged, unit)
        if compared:
            notes.append(COMPARED.format(unit=unit))
        if idle:
            late = sum(not row["began"] for row in idle)
            notes.append(
                f"left out: {late} runs that ended before their fault began, and {len(idle) - late} whose run without "
                "a fault does not hold the object"
            )
        return StudyResult(
            f"{len(table) - 1} faults, {len(judged)} runs next to those without (simulated)",
            _headed(_COLUMNS, unit),
            table,
            partial(plot_faults, rows=judged),
            notes,
            {
                "runs": judged,
                "left_out": idle,
                "without": [*alone.values()],
                "failures": failures,
                "figures_are": "simulated",
            },
            more=compared,
            warnings=[f"failed: {name}: {reason}" for name, reason in failures.items()],
        )


def _planned(options: FaultsOptions, seed: int) -> list[Case]:
    """Return the runs, those without a fault first. Raises PluginError for an unknown fault, controller, detector."""
    host = PluginHost()
    require_free(options.settings, VARIED)
    config = load_config(Path(options.rig) if options.rig else None, options.settings, host=host)
    require_end(config)
    # Before the defaults are replaced, which then count as given.
    options = _of_the_rig(config, options)
    options = with_own_defaults(host, options, {"controllers": "controller", "detectors": "detector"})
    names = _once(backend_names(host, "fault", options.faults))
    controllers = _once(backend_names(host, "controller", options.controllers))
    detectors = _once(backend_names(host, "detector", options.detectors))
    scaled = {name: _is_scaled(host, name) for name in names}
    if options.quick and not options.faults:
        names = names[::3]
    options = quickened(options, QUICK)
    severities, moments = sorted(set(options.severities)), _once(options.moments)
    seeds = range(seed + 1, seed + 1 + options.seeds)
    settings = tuple(options.settings)
    without = [
        Case(who, by, own, settings=settings, rig=options.rig)
        for who, by, own in product(controllers, detectors, seeds)
    ]
    return without + [
        Case(who, by, own, name, severity, moment, settings, options.rig)
        for name in names
        for severity in (severities if scaled[name] else [0])
        for moment, own, who, by in product(moments, seeds, controllers, detectors)
    ]


def _of_the_rig(config: RigConfig, options: FaultsOptions) -> FaultsOptions:
    """Return the options with the rig file's controller and detector, where none are given."""
    if not options.rig:
        return options
    own = {"controllers": [config.section("controller").backend], "detectors": [config.section("detector").backend]}
    return options.model_copy(update={field: v for field, v in own.items() if field not in options.model_fields_set})


def _once(names: Sequence[Any]) -> list[Any]:
    return list(dict.fromkeys(names))


def _is_scaled(host: PluginHost, name: str) -> bool:
    """Return whether a fault has severities; that of another plugin has them if its options do."""
    from lsds_mocks.faults.catalogue import CATALOGUE

    own = {entry.name: bool(entry.levels) for entry in CATALOGUE}
    owner, _, bare = name.rpartition(":")
    if owner in ("", OWN_PREFIX, OWN_DISTRIBUTION) and bare in own:
        return own[bare]
    model = host.options_model(host.find("fault", name))
    return model is not None and "severity" in model.model_fields


def _judged(row: Row, alone: Row) -> Row:
    """Return a run with its verdict, "" if it shows nothing of the fault."""
    comparable = row["began"] and _compared_outcome(alone) == Outcome.HELD
    same = _compared_outcome(row) == _compared_outcome(alone)
    peak, usual = row["peak_n"], alone["peak_n"]
    squeezed = bool(peak and usual and peak > SQUEEZED * usual)
    stopped = "" if row["error"] is None else "unnamed" if row["unnamed"] else "stopped"
    verdict = stopped or ("harmless" if same else "missed")
    own, usual_m = row["apertures_m"][row["moment"]], alone["apertures_m"][row["moment"]]
    # A run without the fault may not come to the stage at which it begins, as without a slip.
    widest_m = [own[0], usual_m[1] if usual_m else own[0]] if own else []
    opened = own is not None and own[1] > max(widest_m) + OPENED_BY_FAULT_M
    return row | {
        "verdict": verdict if comparable else "",
        "squeezed": squeezed,
        "opened": opened,
        "outcome_without": alone["outcome"],
    }


def _compared_outcome(row: Row) -> str:
    """Return the outcome of a run; one that left the model's validity with the object in the grip counts as held."""
    return str(Outcome.HELD if row["outcome"] == Outcome.OUTSIDE else row["outcome"])


def _unit(options: FaultsOptions) -> str:
    """Return the name of what the seeds change: a rig file or a setting can give all of them the same gel."""
    fixed = options.rig or any(text.partition("=")[0].strip().endswith(".gel") for text in options.settings)
    return "seeds" if fixed else "gels"


def _bounds_note(total: Row, unit: str) -> str:
    """Return the counts of missed and opened runs, over runs and over gels, and what their bounds are about."""
    parts = []
    for word, runs in (("missed", total["missed_runs"]), ("opened", total["opened"])):
        most = total[f"{word}_most"]
        bound = (
            "no bound (pip install 'lsds-tactile[search]')" if most is None else f"at most {100 * most:.0f} % of {unit}"
        )
        parts.append(
            f"{word}: {runs} of {total['runs']} runs, on {total[f'{word}_gels']} of {total['gels']} {unit}; {bound}"
        )
    return (
        "; ".join(parts) + f" (upper bounds with {100 * (1 - OUTSIDE):.0f} % confidence, each on the share of {unit} "
        f"with at least one such run among these simulated faults, severities and moments; the n is the number of "
        f"{unit}, because runs of one are not independent; the mean rate per run over all {unit} is no larger)"
    )


def _arm_note(rows: Sequence[Row]) -> str:
    """Return the number of arm commands that move, sent after the arm was stopped."""
    counts = [row["arm_moves_after_stop"] for row in rows if row["arm_moves_after_stop"] is not None]
    text = (
        f"arm commands that move, sent after the stop: {sum(counts)}, in {sum(count > 0 for count in counts)} of "
        f"{len(counts)} runs (stop commands and zero velocities are no movement)"
    )
    absent = len(rows) - len(counts)
    return text + (f"; {absent} runs without an arm" if absent else "")


def _others_note(rows: Sequence[Row]) -> list[str]:
    """Return what happened in the runs that are not judged, if something did that may never happen."""
    unnamed = sum(row["unnamed"] for row in rows)
    opened = sum(row.get("opened", False) for row in rows)
    moves = sum((row["arm_moves_after_stop"] or 0) > 0 for row in rows)
    if not (unnamed or opened or moves):
        return []
    return [
        f"in the {len(rows)} runs that were left out or have no fault: {unnamed} unnamed errors, {opened} opened, and "
        f"{moves} with arm commands that move after the stop"
    ]


def _by_gel(rows: Sequence[Row], word: str) -> Row:
    """Return the number of gels with at least one missed or opened run, and the upper bound on their share.

    The bound is None without scipy.
    """
    gels = {row["seed"] for row in rows}
    affected = {row["seed"] for row in rows if (row["opened"] if word == "opened" else row["verdict"] == word)}
    try:
        most = exact_bounds(len(affected), len(gels), OUTSIDE)[1]
    except MissingExtra:
        most = None
    return {f"{word}_gels": len(affected), f"{word}_most": most}


def _summary(name: str, rows: Sequence[Row]) -> Row:
    safe = [row["safe_s"] for row in rows if row["safe_s"] is not None]
    errors = sorted({row["error"] for row in rows if row["error"]})
    return {
        "fault": name,
        "runs": len(rows),
        "gels": len({row["seed"] for row in rows}),
        **{
            word: float(np.mean([row["verdict"] == word for row in rows])) for word in ("stopped", "harmless", "missed")
        },
        "missed_runs": sum(row["verdict"] == "missed" for row in rows),
        **_by_gel(rows, "missed"),
        **_by_gel(rows, "opened"),
        "unnamed": sum(row["verdict"] == "unnamed" for row in rows),
        "opened": sum(row["opened"] for row in rows),
        "squeezed": float(np.mean([row["squeezed"] for row in rows])),
        "safe_s": float(np.median(safe)) if safe else None,
        "safe_max_s": max(safe, default=None),
        "errors": ", ".join(errors) if name != "all" else "",
    }


def _compared(rows: Sequence[Row], unit: str) -> list[StudyTable]:
    """Compare controllers, and detectors, by the missed runs of the same faults: over gels, and over runs."""
    table: list[Row] = []
    for part, other in (("controller", "detector"), ("detector", "controller")):
        by: dict[str, dict[tuple[Any, ...], bool]] = {}
        for row in rows:
            what = tuple(row[key] for key in ("seed", "fault", "severity", "moment", other))
            by.setdefault(row[part], {})[what] = row["verdict"] == "missed"
        for one, two in combinations(sorted(by), 2):
            pairs: list[tuple[bool, bool]] = []
            of_gels: dict[int, int] = {}
            for what in by[one].keys() & by[two].keys():
                pair = by[one][what], by[two][what]
                pairs.append(pair)
                of_gels[what[0]] = of_gels.get(what[0], 0) + pair[0] - pair[1]
            more = [*of_gels.values()]
            table.append(
                {
                    "pair": f"{one}, {two}",
                    "runs": len(pairs),
                    "missed": f"{sum(a for a, _ in pairs)} and {sum(b for _, b in pairs)}",
                    "gels": len(more),
                    "worse": f"{sum(value > 0 for value in more)} and {sum(value < 0 for value in more)}",
                    "p": sign_test(more),
                    "p_runs": mcnemar(pairs),
                }
            )
    if not table:
        return []
    for key in ("p", "p_runs"):
        corrected = holm({row["pair"]: row[key] for row in table})
        for row in table:
            row[key] = corrected[row["pair"]]
    return [StudyTable(_headed(_COMPARED, unit), table)]


def _headed(columns: Sequence[tuple[str, str, str]], unit: str) -> list[tuple[str, str, str]]:
    """Return the columns with the name of the unit in their headings."""
    return [(key, heading.format(unit=unit), form) for key, heading, form in columns]


def _of(rows: Sequence[Row], key: str, value: str) -> list[Row]:
    return [row for row in rows if row[key] == value]
