"""Signed margins of a run, one for each way to fail: 1 is best, below 0 is a failure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lsds.clock import cpu_ns
from lsds.config.overrides import override_texts
from lsds.errors import CallHangs, LsdsError, PluginError
from lsds.session.run import run

if TYPE_CHECKING:
    from lsds.contracts import CellTruth
    from lsds.session.run import Session
    from lsds_research.search.space import Scenario

OPENED_M = 1e-3
"""A drop with the fingers wider by this than at take-up counts as an opening (m)."""
HANGS_S = 120.0
"""A run with more computing time than this counts as a hang (s)."""
STOPPED = 0.1
"""Margin of a run that an expected error stopped."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a failure: slip (m), and the ratio of peak grip to the needed or the initial grip."""

    slip_m: float = 0.03
    peak: float = 5.0


def run_scenario(asked: tuple[Scenario, Limits, tuple[str, ...]]) -> dict[str, Any]:
    """Run a scenario with more config keys; return its margins by name, and its identification."""
    scenario, limits, settings = asked
    began_ns = cpu_ns()
    try:
        session = run(None, [*override_texts(scenario), *settings])
    except LsdsError as error:
        return {"margins": {"named": STOPPED}, "outcome": "not run", "fault": str(error), "simulated_s": 0.0}
    except Exception as error:
        return {"margins": {"named": -1.0}, "outcome": "not run", "fault": f"{type(error).__name__}: {error}"}
    margins = margins_of(session, limits)
    # Two values only: a margin from computing time would not be reproducible.
    margins["ends"] = -1.0 if hangs(session.fault) or (cpu_ns() - began_ns) * 1e-9 > HANGS_S else 1.0
    summary = session.summary
    return {
        "margins": margins,
        "outcome": summary["outcome"],
        "fault": summary["fault"],
        "simulated_s": summary.get("simulated_s", 0.0),
    }


def hangs(fault: BaseException | None) -> bool:
    """Return whether a run ended because a call did not return."""
    return isinstance(fault, CallHangs)


def margins_of(session: Session, limits: Limits) -> dict[str, float]:
    """Return the margins of a completed run."""
    fault, truths = session.fault, session.truths
    if fault is not None:
        return {"named": -1.0 if _is_unnamed(fault) else STOPPED}
    lifted = [truth for truth in truths if not truth.supported]
    slip_m = truths[-1].slip_distance_m
    dropped = session.summary["outcome"] != "held"
    if not lifted:
        return {"holds": -1.0 if dropped else 1.0}
    first_n = next((t.normal_force_n for t in truths if t.t_ns >= lifted[0].t_ns), 0.0)
    needed_n = max(max(truth.required_normal_force_n for truth in lifted), first_n, 1e-3)
    peak = max(truth.normal_force_n for truth in lifted) / needed_n
    return {
        "holds": -1.0 if dropped else 1.0,
        "slips little": max(-1.0, 1 - slip_m / limits.slip_m),
        "does not crush": max(-1.0, (limits.peak - peak) / (limits.peak - 1)),
        "does not open": -1.0 if dropped and _opens(truths) else 1.0,
    }


def _is_unnamed(fault: BaseException) -> bool:
    """Return whether an error is one that no part of the project raises on purpose."""
    return not isinstance(fault, LsdsError) or (isinstance(fault, PluginError) and fault.__cause__ is not None)


def _opens(truths: Sequence[CellTruth]) -> bool:
    held = [truth for truth in truths if not truth.supported]
    return bool(held) and max(t.aperture_m for t in held) > held[0].aperture_m + OPENED_M


def least(margins: dict[str, float]) -> tuple[str, float]:
    """Return the minimum margin and its name."""
    return min(margins.items(), key=lambda item: (item[1], item[0]), default=("named", math.nan))
