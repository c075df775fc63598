"""The lifts of whole configurations, and the result of each configuration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lsds.config.overrides import override_texts
from lsds.errors import DataError
from lsds_research.campaign_options import thinned
from lsds_research.collecting.objects import check_objects
from lsds_research.studies.grip.lift import Lift

if TYPE_CHECKING:
    from lsds_research.studies.loop.options import LoopOptions

    Row = dict[str, Any]

LIFT_SPEED_M_S = 0.038
"""Speed of the arm in the lift, m/s: the default of `task.lift_speed_m_s`."""
MET_MM = 0.05
"""Slip above which a run reached the friction limit, mm; chosen as in the study `grip`."""


class Configuration(NamedTuple):
    """Backends of a rig, by kind, and its budget of time for a frame; 0: none."""

    tracker: str
    detector: str
    estimator: str
    controller: str
    budget_ms: float = 0.0

    def __str__(self) -> str:
        budget = f" {self.budget_ms:g} ms" if self.budget_ms else ""
        return f"{self.tracker} {self.detector}+{self.estimator} {self.controller}{budget}"

    def backends(self) -> dict[str, str]:
        """Return the names of the backends by kind."""
        return {kind: str(name) for kind, name in self._asdict().items() if kind != "budget_ms"}

    def settings(self) -> tuple[str, ...]:
        """Return the config's keys, without the controller's."""
        kinds = {"tracker": self.tracker, "detector": self.detector, "estimator": self.estimator}
        keys: dict[str, Any] = {f"{kind}.backend": name for kind, name in kinds.items()}
        return tuple(override_texts(keys | ({"tactile.budget_ms": self.budget_ms} if self.budget_ms else {})))


def configurations(options: LoopOptions) -> list[Configuration]:
    """Return the compared configurations. Raises DataError for a malformed pair."""
    pairs = [each.partition("+") for each in options.pairs]
    if wrong := ["".join(pair) for pair in pairs if not all(pair) or "+" in pair[2]]:
        raise DataError(f"--pair {', '.join(wrong)}: write DETECTOR+ESTIMATOR, such as fused+fused")
    trackers = options.trackers[:1] if options.quick else options.trackers
    return [
        Configuration(who, eye, gauge, law, budget)
        for who, (eye, _, gauge), law, budget in product(trackers, pairs, options.controllers, options.budgets_ms)
    ]


def planned(options: LoopOptions, seed: int) -> Iterator[tuple[Configuration, Lift]]:
    """Yield each lift with its configuration. Raises ConfigError for an unknown object."""
    check_objects(options.objects)
    objects = thinned(options, "objects", 2)
    squeezes = options.squeezes_mm[:1] if options.quick else options.squeezes_mm
    for each, name, squeeze in product(configurations(options), objects, squeezes):
        settings = each.settings()
        yield each, Lift(each.controller, name, squeeze, LIFT_SPEED_M_S, 1.0, "none", seed + 1, 0.0, settings=settings)


def summarized(each: Configuration, rows: Sequence[Row]) -> Row:
    """Return the row of a configuration: medians over its lifts, slip and grip of those that slipped."""
    met = [row for row in rows if row["slip_mm"] > MET_MM] or rows
    return {
        "configuration": str(each),
        **each._asdict(),
        "runs": len(rows),
        "held": float(np.mean([row["held"] for row in rows])),
        "frame_us": _median(rows, "frame_mean_us"),
        "cost": _median(rows, "cost"),
        "slip_mm": _median(met, "slip_mm"),
        "steady": _median([row for row in met if row["steady_over_needed"] is not None], "steady_over_needed"),
        "steady_all": _median([row for row in rows if row["steady_over_needed"] is not None], "steady_over_needed"),
    }


def _median(rows: Sequence[Row], name: str) -> float | None:
    return float(np.median([row[name] for row in rows])) if rows else None


def mark_front(rows: Sequence[Row]) -> None:
    """Mark the Pareto front of time, slip and steady grip; a configuration that drops an object is not on it."""
    for row in rows:
        row["front"] = row["held"] == 1 and beaten_by(row, rows) is None


def beaten_by(row: Row, rows: Sequence[Row]) -> Row | None:
    """Return the quickest configuration that is no worse in anything and better in something, None on the front."""
    return min((other for other in rows if _beats(other, row)), key=lambda other: other["frame_us"], default=None)


def _beats(other: Row, row: Row) -> bool:
    if other["held"] < 1 or other["steady"] is None:
        return False
    names = ("frame_us", "slip_mm", "steady")
    return all(other[n] <= row[n] for n in names) and any(other[n] < row[n] for n in names)
