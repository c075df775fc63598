"""One lift with or without a fault, and its outcome."""

from __future__ import annotations

import traceback
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from lsds.config.overrides import override_texts
from lsds.config.reading import read_toml
from lsds.errors import LsdsError
from lsds.registry import PluginHost
from lsds.session.parts import loaded
from lsds.session.run import run
from lsds_research.named_files import files_of_rig, files_of_settings
from lsds_research.search.robustness import is_unnamed
from lsds_research.search.space import flat
from lsds_research.studies.faults.arm_log import arm_log
from lsds_research.studies.faults.options import Moment

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds.contracts import CellTruth

OPENED_BY_FAULT_M = 1e-3
"""Fingers around an object count as opened if their aperture grows by this since the fault, more than without it
(m)."""
RUN_FORMAT = 4
"""Number of the format of a stored run; those of another format are run again."""
KEYS: dict[str, Any] = {"task.lift_s": 1.2, "task.hold_s": 0.8}
"""Config keys of every lift, unless the rig file gives its own: short, for speed."""


@dataclass(frozen=True, slots=True)
class Case:
    """A run. An empty `fault` is the run that the others are compared with; `severity` is 0 for one without a scale.
    `rig` is a rig file, empty for the default rig, in which each seed has another gel."""

    controller: str
    detector: str
    seed: int
    fault: str = ""
    severity: int = 0
    moment: str = ""
    settings: tuple[str, ...] = ()
    rig: str = ""

    @property
    def key(self) -> str:
        """Key of the stored run."""
        return f"{RUN_FORMAT} {self.pair} {self.fault} {self.severity} {self.moment}"

    @property
    def pair(self) -> str:
        """Name of the settings in common with the run without a fault."""
        rig = f" {self.rig} {files_of_rig(self.rig)}" if self.rig else ""
        named = files_of_settings(self.settings)
        files = f" {named}" if named else ""
        return f"{self.controller} {self.detector} {self.seed} {' '.join(self.settings)}{files}{rig}"

    def overrides(self, log: str = "") -> list[str]:
        """Return the config keys of the run; `log` is the name of an `ArmLog`, which is put around the fault."""
        given = rig_keys(self.rig)
        keys: dict[str, Any] = {key: value for key, value in KEYS.items() if key not in given} | {
            "seed": self.seed,
            "controller.backend": self.controller,
            "detector.backend": self.detector,
        }
        if not self.rig:
            keys["sensor.mock-gelsight-mini.gel"] = self.seed
        overrides = [*override_texts(keys), *self.settings]
        if not self.fault:
            return overrides
        # Those of the rig stay, as in the run without the fault.
        faults: list[dict[str, Any]] = [
            *faults_of(self.rig),
            {"backend": self.fault, "at": self.moment, "severity": self.severity or None},
        ]
        if log:
            faults.append({"backend": log})
        return [*overrides, *override_texts({"faults": faults})]


@cache
def rig_keys(rig: str) -> frozenset[str]:
    """Return the config keys that a rig file gives; none for "". Raises ConfigError for a file that cannot be read."""
    return frozenset(key for key, _ in flat(_tables(rig)))


def faults_of(rig: str) -> list[dict[str, Any]]:
    """Return the faults that a rig file injects itself; none for ""."""
    return list(_tables(rig).get("faults", ()))


@cache
def _tables(rig: str) -> dict[str, Any]:
    return read_toml(Path(rig)) if rig else {}


def run_case(case: Case) -> dict[str, Any] | str:
    """Run a case; return its figures, or the reason of a failure."""
    try:
        with arm_log() as (name, log):
            counted = bool(case.fault) and _has_arm(case)
            session = run(case.rig or None, case.overrides(name if counted else ""))
        session.require_uninterrupted()
    except LsdsError as error:
        return f"{case.key}: {error}"
    summary, fault, truths = session.summary, session.fault, session.truths
    onset_ns = session.stages.began_ns(case.moment or "take up")
    held = [truth for truth in truths if onset_ns is not None and truth.t_ns >= onset_ns]
    planted = [case.fault, *(own["backend"] for own in faults_of(case.rig))]
    moments = (case.moment,) if case.moment else get_args(Moment)
    return {
        "controller": case.controller,
        "detector": case.detector,
        "seed": case.seed,
        "fault": case.fault,
        "severity": case.severity,
        "moment": case.moment,
        "pair": case.pair,
        "outcome": summary["outcome"],
        "sentence": session.verdict.sentence,
        "error": None if fault is None else type(fault).__name__,
        "unnamed": fault is not None and is_unnamed(fault) and not _is_planted(fault, planted),
        "reason": summary["fault"],
        "unusable_frames": summary["unusable_frames"],
        "slip_mm": None if summary["slip_distance_m"] is None else 1e3 * summary["slip_distance_m"],
        "peak_n": summary["peak_normal_force_n"],
        "began": onset_ns is not None,
        # The time from the fault to the end of the run; `arm_moves_after_stop` counts later commands.
        "safe_s": (truths[-1].t_ns - held[0].t_ns) * 1e-9 if held and fault is not None else None,
        "arm_moves": log.moves if counted else None,
        "arm_moves_after_stop": log.moves_after_stop if counted else None,
        "apertures_m": {moment: _apertures_m(truths, session.stages.began_ns(moment)) for moment in moments},
    }


def _is_planted(error: BaseException, faults: Sequence[str]) -> bool:
    """Return whether an error names the part of which a fault has raised an exception, as it was to: that is no mistake
    of the project."""
    cause = error.__cause__
    if not isinstance(error, LsdsError) or cause is None:
        return False
    frames = [frame for frame, _ in traceback.walk_tb(cause.__traceback__)]
    host = PluginHost()
    modules = {host.find("fault", name).spec.factory.partition(":")[0] for name in faults if name}
    return bool(frames) and frames[-1].f_globals.get("__name__") in modules


def _has_arm(case: Case) -> bool:
    """Return whether the rig has an arm: a fault of an arm that it lacks is an error."""
    section = loaded(case.rig or None, case.overrides()).arm
    return section is not None and section.backend != "none"


def _apertures_m(truths: Sequence[CellTruth], since_ns: int | None) -> list[float] | None:
    """Return the aperture of fingers around an object at a time, or at the first contact after it, and the largest
    since; None if they never held anything."""
    held = [truth for truth in truths if since_ns is not None and truth.t_ns >= since_ns]
    first = next((at for at, truth in enumerate(held) if truth.normal_force_n > 0), None)
    if first is None:
        return None
    return [held[first].aperture_m, max(truth.aperture_m for truth in held[first:])]
