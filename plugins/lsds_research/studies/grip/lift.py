"""One lift of the study `grip`: its settings and its outcome."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.clock import NS_PER_S, cpu_ns
from lsds.config.overrides import override_texts
from lsds.errors import LsdsError
from lsds.session.run import run
from lsds_research.collecting.objects import PLANS
from lsds_research.named_files import files_of_settings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lsds.contracts import CellTruth, Cycle
    from lsds.session.verdict import Verdict

OFF = "off"
OBJECT_KEY = "cell.simulated.object"
STEADY_GRIP_S = 0.5
"""The steady grip is the mean over this time at the end of a lift."""
AFTER_SLIP_S = 0.3
"""A closing later than this after the last true slip counts as a closing without slip."""
SLIPS_M_S = 1e-3
"""True slip velocity above which the object slips, m/s; chosen."""
CLOSES_M = 2e-4
"""Minimum step of a closing, about a tick of a Hand-E."""
LATE_NS = 5 * NS_PER_S
"""The fingers' reversals are counted over this time at the end of a run; chosen, some ten answers of a gripper."""
CHANGES: dict[str, dict[str, Any]] = {
    "none": {},
    "pour": {
        "cell.simulated.changes_after_s": 1.5,
        "cell.simulated.pour_to": 2.0,
        "cell.simulated.pour_s": 3.0,
        "task.hold_s": 4.0,
    },
    "shove": {"cell.simulated.changes_after_s": 2.5, "cell.simulated.shove_s": 0.2, "task.hold_s": 2.0},
    "wet": {"cell.simulated.changes_after_s": 2.5, "cell.simulated.wet_to": 0.5, "task.hold_s": 2.0},
    "brisk": {"task.lift_acceleration_m_s2": 2.0, "safety.max_arm_acceleration_m_s2": 2.0},
    "turn": {"cell.simulated.centre_x_mm": 10.0},
}
"""Options of each change of load. A shove is half of the object's weight; an object that turns is gripped off its
centre, half-way up."""


MIDDLE_FRICTION = 0.55
"""Static friction in the middle of the catalogue, used to derive an object's weight from the force it needs."""


def weight_n(name: str) -> float:
    """Return the weight (N) of an object of the catalogue."""
    return round(2 * MIDDLE_FRICTION * PLANS[name].needed_n, 3)


@dataclass(frozen=True, slots=True)
class Lift:
    """A run; the controller does not know the object. `cell` describes an object outside the catalogue."""

    controller: str
    object: str
    squeeze_mm: float
    speed_m_s: float
    friction: float
    change: str
    seed: int
    weight_n: float
    probe: bool = False
    fragile_n: float | None = None
    settings: tuple[str, ...] = ()
    cell: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Key that identifies this run."""
        files = files_of_settings(self.settings)
        return " ".join(f"{name}={value}" for name, value in asdict(self).items()) + (f" {files}" if files else "")

    def overrides(self) -> list[str]:
        """Return the config's keys."""
        keys: dict[str, Any] = {
            "seed": self.seed,
            "sensor.mock-gelsight-mini.gel": self.seed,
            "cell.simulated.friction_scale": self.friction,
            "task.grasp": "touch",
            "task.first_squeeze_m": self.squeeze_mm * 1e-3,
            "task.lift_speed_m_s": self.speed_m_s,
            # As high as the arm can reach, whatever the speed.
            "task.lift_s": min(3.0, 0.12 / self.speed_m_s),
            "task.hold_s": 1.5,
            **CHANGES[self.change],
        }
        if not self.cell:
            keys[OBJECT_KEY] = self.object
        if self.change == "shove":
            keys["cell.simulated.shove_n"] = 0.5 * self.weight_n
        if self.change == "turn":
            keys["cell.simulated.grip_height_mm"] = PLANS[self.object].length_mm / 2
        if self.controller == OFF:
            keys["controller.enabled"] = False
        else:
            keys["controller.backend"] = self.controller
        if self.fragile_n is not None:
            keys["task.fragile_n"] = self.fragile_n
        if self.probe:
            keys["task.probe"] = True
        return [*override_texts(keys), *self.cell, *self.settings]


def lift(what: Lift) -> dict[str, Any] | str:
    """Run a lift; return its figures, or the reason of a failure."""
    closings: list[int] = []
    commanded: list[tuple[int, float]] = []
    held_m = math.nan

    def take(cycle: Cycle) -> None:
        nonlocal held_m
        if cycle.command_m is not None and cycle.command_m < held_m - CLOSES_M:
            closings.append(cycle.t_ns)
        held_m = cycle.held_m
        if math.isfinite(held_m):
            commanded.append((cycle.t_ns, held_m))

    began_ns = cpu_ns()
    try:
        session = run(None, what.overrides(), observe=take)
        session.require_uninterrupted()
    except LsdsError as error:
        return f"{what.key}: {error}"
    after_s = CHANGES[what.change].get("cell.simulated.changes_after_s")
    found = asdict(what) | figures(session.summary, session.verdict, session.truths, closings, after_s)
    found["frame_us"] = session.summary["frame_to_command_us"]["p50"]
    found["frame_mean_us"] = session.summary["frame_to_command_us"]["mean"]
    end_ns = session.truths[-1].t_ns
    found["late_reversals"] = sum(t_ns > end_ns - LATE_NS for t_ns in reversals(commanded))
    simulated_ns = end_ns - session.truths[0].t_ns
    found["cost"] = (cpu_ns() - began_ns) / max(simulated_ns, 1)
    margin = session.verdict.force_margin
    return found | {"crushed": None if what.fragile_n is None or margin is None else margin < 0}


def reversals(commanded: Sequence[tuple[int, float]]) -> list[int]:
    """Return the times (ns) at which commanded apertures (ns, m) have turned back by a closing's least step."""
    found: list[int] = []
    direction, extreme_m = 0.0, commanded[0][1] if commanded else math.nan
    for t_ns, aperture_m in commanded:
        step_m = aperture_m - extreme_m
        if direction * step_m > 0:
            extreme_m = aperture_m
        elif abs(step_m) >= CLOSES_M:
            if direction:
                found.append(t_ns)
            direction, extreme_m = math.copysign(1.0, step_m), aperture_m
    return found


def figures(
    summary: dict[str, Any], verdict: Verdict, truths: Any, closings: list[int], after_s: float | None
) -> dict[str, Any]:
    """Return the figures of a run, from its summary, its verdict, the truth, the times (ns) of closings, and how long
    after the lift (s) its load changed, if it did. `held`: the object is in the grip at the end."""
    t_s, normal, required, slip = _columns(truths)
    lifted = np.array([not truth.supported for truth in truths])
    start = int(np.argmax(normal > 0)) if not lifted.any() else int(np.argmax(lifted))
    end = t_s > t_s[-1] - STEADY_GRIP_S
    held = verdict.in_grip
    sliding = t_s[np.abs(slip) > SLIPS_M_S]
    without = [at for at in closings if not np.any((sliding <= at * 1e-9) & (sliding > at * 1e-9 - AFTER_SLIP_S))]
    needed = float(required[start:].max())
    first = float(normal[max(0, start - 1)])
    slipped_m = np.array([truth.slip_distance_m for truth in truths])
    changes = len(t_s) if after_s is None else int(np.searchsorted(t_s, t_s[start] + after_s))
    return {
        "outcome": summary["outcome"],
        "sentence": verdict.sentence,
        "fault": summary["fault"],
        "held": held,
        "slip_mm": 1e3 * float(slipped_m[-1]),
        "change_slip_mm": 1e3 * float(slipped_m[-1] - slipped_m[changes]) if changes < len(t_s) else None,
        "turned_deg": math.degrees(_turned_rad(truths)),
        "arrest_s": summary["time_to_arrest_s"],
        "needed_n": needed,
        "first_over_needed": first / needed,
        "peak_over_needed": float(normal[start:].max()) / needed,
        "steady_over_needed": float(np.mean(normal[end] / required[end])) if held else None,
        "steady_excess_n": float(np.mean(normal[end] - required[end])) if held else None,
        "peak_n": float(normal.max()),
        "closings": len(closings),
        "closings_without_slip": len(without),
    }


def _turned_rad(truths: Sequence[CellTruth]) -> float:
    """Return the final turn of the object in the grip."""
    steps = np.diff([truth.t_ns for truth in truths], prepend=truths[0].t_ns) * 1e-9
    return abs(float(np.dot(steps, [truth.slip_angular_rad_s for truth in truths])))


def _columns(truths: list[CellTruth]) -> tuple[NDArray[np.float64], ...]:
    rows = [
        (t.t_ns * 1e-9, t.normal_force_n, t.required_normal_force_n, math.hypot(*t.slip_velocity_m_s)) for t in truths
    ]
    return tuple(np.array(rows, float).T)
