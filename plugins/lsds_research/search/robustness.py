"""Signed margins of a run, one for each way to fail: 1 is best, below 0 is a failure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lsds.config.overrides import override_texts
from lsds.contracts.task import TaskOptions
from lsds.errors import CallHangs, DataError, LsdsError, PluginError
from lsds.session.run import run
from lsds.session.verdict import Outcome

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds.session.run import Session
    from lsds_research.search.space import Scenario

STOPPED_MARGIN = 0.1
"""Margin of a run that an expected error stopped."""
MOST_NOT_RUN = 0.1
"""Largest share of scenarios that could not run; chosen."""
NOT_RUN = "not run"
"""Outcome of a scenario whose lift could not begin."""
_TASK = TaskOptions()


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a failure: slip (m), and the ratio of peak grip to the needed or the initial grip; None: that of the
    config."""

    slip_m: float | None = _TASK.max_slip_m
    peak: float | None = _TASK.max_grip_ratio

    def overrides(self) -> list[str]:
        """Return the config keys of the limits, so that `lsds run` judges by the same."""
        keys = {"task.max_slip_m": self.slip_m, "task.max_grip_ratio": self.peak}
        return override_texts({key: value for key, value in keys.items() if value is not None})


def run_scenario(asked: tuple[Scenario, Limits, tuple[str, ...]]) -> dict[str, Any]:
    """Run a scenario with more config keys; return its margins by name, and its identification."""
    scenario, limits, settings = asked
    try:
        session = run(None, [*override_texts(scenario), *limits.overrides(), *settings])
        session.require_uninterrupted()
    except LsdsError as error:
        return {"margins": {"named": STOPPED_MARGIN}, "outcome": NOT_RUN, "fault": str(error), "simulated_s": 0.0}
    except Exception as error:
        return {"margins": {"named": -1.0}, "outcome": NOT_RUN, "fault": f"{type(error).__name__}: {error}"}
    margins = margins_of(session)
    # Computing time decides nothing: it differs from machine to machine.
    margins["ends"] = -1.0 if hangs(session.fault) else 1.0
    summary = session.summary
    return {
        "margins": margins,
        "outcome": summary["outcome"],
        "sentence": session.verdict.sentence,
        "fault": summary["fault"],
        "simulated_s": summary.get("simulated_s", 0.0),
        "slip_m": summary["slip_distance_m"],
        "ratio": session.verdict.grip_over_needed,
        "delay_s": session.verdict.detection_delay_s,
        "invalid": session.verdict.invalid,
    }


def run_warnings(rows: Sequence[dict[str, Any]], most: float = MOST_NOT_RUN) -> list[str]:
    """Return warnings on the scenarios whose lift could not begin, and on those that an unexpected error ended.

    Raises DataError if those that could not begin are more than the share `most`: what is counted among the others
    would not be what was asked. A search, which goes where scenarios fail, passes 1.
    """
    broken = [row["fault"] for row in rows if row["margins"].get("named", 1.0) < 0]
    text = f"{len(broken)} of {len(rows)} scenarios ended with an unexpected error and count as failures; the first: "
    warnings = [text + str(broken[0])] if broken else []
    found = [row for row in rows if row["outcome"] == NOT_RUN and least(row["margins"])[1] >= 0]
    if not found:
        return warnings
    text = (
        f"{len(found)} of {len(rows)} scenarios could not run and count as no failure; the first: {found[0]['fault']}"
    )
    if len(found) > most * len(rows):
        raise DataError(f"{text} (narrow the range of that key)")
    return [*warnings, text]


def hangs(fault: BaseException | None) -> bool:
    """Return whether a run ended because a call did not return."""
    return isinstance(fault, CallHangs)


def margins_of(session: Session) -> dict[str, float]:
    """Return the margins of a completed run: one is below 0 if the verdict on the run is a failure of the cell.

    A run outside the model's validity is no failure of the cell.
    """
    verdict, fault = session.verdict, session.fault
    if fault is not None:
        return {"named": -1.0 if is_unnamed(fault) else STOPPED_MARGIN}
    margins = {"holds": 1.0 if verdict.in_grip else -1.0}
    if verdict.slip_margin is not None:
        margins["slips little"] = max(-1.0, verdict.slip_margin)
    if verdict.force_margin is not None:
        margins["does not crush"] = max(-1.0, verdict.force_margin)
    if verdict.outcome is Outcome.DROPPED:
        margins["does not open"] = -1.0 if verdict.opened else 1.0
    return margins


def is_unnamed(fault: BaseException) -> bool:
    """Return whether an error is one that no part of the project raises on purpose."""
    return not isinstance(fault, LsdsError) or (isinstance(fault, PluginError) and fault.__cause__ is not None)


def least(margins: dict[str, float]) -> tuple[str, float]:
    """Return the minimum margin and its name."""
    return min(margins.items(), key=lambda item: (item[1], item[0]), default=("named", math.nan))
