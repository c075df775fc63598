"""Study `slide`: intended slip of objects that slide or turn through the fingers at a commanded rate."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.threads import processes
from lsds.config.overrides import override_texts
from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult
from lsds.errors import DataError, LsdsError
from lsds.registry.host import PluginHost
from lsds.session.run import run
from lsds.support.processes import DIED, spread
from lsds_research.collecting.objects import PLANS, check_objects
from lsds_research.study_backends import with_own_defaults

if TYPE_CHECKING:
    from lsds.contracts import Cycle

BEGUN_S = 0.4
"""Time until the gel is sheared and the arm is at speed, before the object slides."""
SHORTEST_MM = 100.0
"""Minimum length of an object; the fingers would slide off a shorter one."""
_COLUMNS = (
    ("what", "wanted", ""),
    ("runs", "runs", "d"),
    ("rms", "off, RMS", ".3f"),
    ("worst", "worst", ".3f"),
    ("mean", "mean/wanted", ".3f"),
    ("told", "estimated/wanted", ".2f"),
    ("grown", "force grown to", ".2f"),
)


class SlideOptions(BaseModel):
    """Let objects slide or turn through the fingers at a commanded rate: the job 'slide', on every object long enough.

    Objects that slide stand on a table, and objects that turn are clamped. Figures are simulated.

    Takes: 1 to 3 s of one core per lift.

    \b
    Examples:
      lsds study slide
      lsds study slide --object can --speed 0.005 --seeds 5 --json slide.json
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    objects: list[str] = Field(
        default=[name for name, plan in PLANS.items() if plan.length_mm >= SHORTEST_MM],
        description="object of the catalogue; default: all that are long enough",
        json_schema_extra={"flag": "--object", "metavar": "NAME"},
    )
    speeds_m_s: list[float] = Field(
        default=[0.01],
        description="speed at which to slide, m/s",
        json_schema_extra={"flag": "--speed", "metavar": "M/S"},
    )
    rates_rad_s: list[float] = Field(
        default=[0.5],
        description="rate at which to turn, rad/s",
        json_schema_extra={"flag": "--rate", "metavar": "RAD/S"},
    )
    controllers: list[str] = Field(
        default=["belief"], description="controller", json_schema_extra={"flag": "--controller", "metavar": "NAME"}
    )
    squeeze_mm: float = Field(default=1.4, gt=0, le=10, description="first squeeze, mm")
    seeds: int = Field(default=1, ge=1, le=10_000, description="number of seeds, each with another gel")
    jobs: int = Field(default_factory=processes, ge=1, le=256, description="processes that run")


@dataclass(frozen=True, slots=True)
class Slid:
    """One run: slide at a speed, or turn at a rate."""

    controller: str
    object: str
    speed_m_s: float
    rate_rad_s: float
    squeeze_mm: float
    seed: int

    @property
    def wanted(self) -> float:
        """Speed or rate."""
        return self.rate_rad_s or self.speed_m_s

    @property
    def label(self) -> str:
        """The commanded rate as text for the table."""
        return f"{self.rate_rad_s:g} rad/s" if self.rate_rad_s else f"{100 * self.speed_m_s:g} cm/s"

    def overrides(self) -> list[str]:
        """Return the config's keys."""
        keys: dict[str, Any] = {
            "seed": self.seed,
            "sensor.mock-gelsight-mini.gel": self.seed,
            "cell.simulated.object": self.object,
            "cell.simulated.clamped": bool(self.rate_rad_s),
            "controller.backend": self.controller,
            "job.backend": "lsds:slide",
            "job.slide.speed_m_s": -self.speed_m_s,
            "job.slide.turn_rad_s": self.rate_rad_s,
            "task.first_squeeze_m": self.squeeze_mm * 1e-3,
        }
        return override_texts(keys)


def slid(what: Slid) -> dict[str, Any] | str:
    """Run one; return its figures, or the reason of a failure."""
    sliding: list[tuple[int, float]] = []

    def take(cycle: Cycle) -> None:
        if cycle.stage == "slide":
            estimated = cycle.estimate.angular_rad_s if what.rate_rad_s else cycle.estimate.speed_m_s
            sliding.append((cycle.t_ns, abs(estimated)))

    try:
        session = run(None, what.overrides(), observe=take)
        session.require_uninterrupted()
    except LsdsError as error:
        return f"{what.object}: {error}"
    begun_ns = sliding[0][0] + BEGUN_S * 1e9
    truths = [truth for truth in session.truths if begun_ns <= truth.t_ns <= sliding[-1][0]]
    speeds = [
        abs(truth.slip_angular_rad_s) if what.rate_rad_s else math.hypot(*truth.relative_velocity_m_s)
        for truth in truths
    ]
    share = np.array(speeds) / what.wanted
    forces = [truth.normal_force_n for truth in truths]
    return asdict(what) | {
        "what": what.label,
        "rms": float(np.sqrt(np.mean((share - 1) ** 2))),
        "mean": float(share.mean()),
        "told": float(np.nanmean([estimated for t_ns, estimated in sliding if t_ns >= begun_ns])) / what.wanted,
        "grown": max(forces) / forces[0],
    }


class SlideStudy:
    """A `Study`."""

    def __init__(self, options: SlideOptions, context: BuildContext) -> None:
        self._options, self._seed = options, context.seed

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Run all. Raises ConfigError for an unknown object, DataError if nothing could be run."""
        own = with_own_defaults(PluginHost(), self._options, {"controllers": "controller"})
        check_objects(own.objects)
        motions = [(speed, 0.0) for speed in own.speeds_m_s] + [(0.0, rate) for rate in own.rates_rad_s]
        planned = [
            Slid(who, name, *motion, own.squeeze_mm, self._seed + 1 + seed)
            for who, motion, name, seed in product(own.controllers, motions, own.objects, range(own.seeds))
        ]
        rows, failures = [], []
        for done, (what, result) in enumerate(spread(slid, planned, own.jobs), start=1):
            if isinstance(result, dict):
                rows.append(result)
            else:
                failures.append(f"{what.object}: {result or DIED}")
            tick(done, len(planned))
        if not rows:
            raise DataError(f"nothing could be run; the first: {failures[0]}")
        labels = dict.fromkeys(what.label for what in planned)
        groups = {label: [row for row in rows if row["what"] == label] for label in labels}
        return StudyResult(
            f"intended slip, {len(own.objects)} objects (simulated)",
            _COLUMNS,
            [_summary(label, group) for label, group in groups.items() if group],
            notes=["off: true less commanded speed, over the commanded one; worst: of one run"],
            details={"runs": rows, "failures": failures, "figures_are": "simulated"},
            warnings=[f"failed: {failure}" for failure in failures],
        )


def _summary(label: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "what": label,
        "runs": len(rows),
        "rms": float(np.sqrt(np.mean([row["rms"] ** 2 for row in rows]))),
        "worst": max(row["rms"] for row in rows),
        "mean": float(np.mean([row["mean"] for row in rows])),
        "told": float(np.mean([row["told"] for row in rows])),
        "grown": max(row["grown"] for row in rows),
    }
