"""Job `trial`: one recording of a protocol; each frame gives a row with signals, measured labels and the truth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import NS_PER_S, nanoseconds
from lsds.contracts import BuildContext, Grip, Setting, Situation, Twist, Wanted
from lsds.errors import ConfigError, ConfigIssue, DataError, SafetyStop
from lsds.models.signals import signals_of
from lsds.session.truth_log import TruthLog
from lsds.tactile.gate import RepeatedImage
from lsds.tactile.reference import brightness
from lsds_research.collecting.labels import SlipLabels
from lsds_research.collecting.trials import SLOW_CLOSING_M_S, Job, Trial, trials
from lsds_research.datasets import from_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from lsds.contracts import Cycle, GripperState

APPROACH_M = 4e-3
"""Distance from the object at which the fingers change from fast to slow closing, m."""
FAST_M_S = 0.1
"""Speed of the fingers on their way to the object, m/s; chosen."""
REFERENCE_TIMEOUT_S = 8.0
"""Longest wait for a settled image of the untouched gel, s; chosen."""
TRUTH_HZ = 125.0
"""Rate at which the truth of a simulated cell is sampled, Hz; chosen."""


class TrialOptions(BaseModel):
    """Options of `[job.trial]`: which recording of which protocol."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    protocol: Job = Field(default="pipe", description="protocol to record, as in lsds learn collect")
    number: int = Field(default=0, ge=0, description="number of the recording within the protocol, from 0")


class _Phase(NamedTuple):
    """A phase in which the arm follows `twist` for `duration_s`; the fingers go to `grip` at its start, None leaves
    them.

    `grasps`: the fingers must arrive before the phase ends. `poses_count`: poses are used for labels.
    """

    duration_s: float
    grip: Grip | None
    twist: Twist
    poses_count: bool = True
    grasps: bool = False


class TrialJob:
    """A `Job` that grasps, executes the moves of a trial, and records every frame. Slip is not corrected.

    `measured`: labels come from a pose source; otherwise they are the simulated cell's truth. `also` is called with the
    cycle of each recorded frame.
    """

    def __init__(self, trial: Trial, *, measured: bool, also: Callable[[Cycle], object] | None = None) -> None:
        self._trial, self._also = trial, also
        self._measured = measured

    def begin(self, setting: Setting) -> None:
        """Begin with the untouched gel. Raises ConfigError without a gripper or an arm."""
        if setting.gripper is None or setting.arm is None:
            issue = ConfigIssue("gripper.backend, arm.backend", "a trial needs a gripper and an arm", "choose both")
            raise ConfigError("the rig", [issue])
        self._task = setting.task
        self._stroke_m = setting.gripper.stroke_m
        self._truth = TruthLog(setting.cell, TRUTH_HZ)
        self._labels = SlipLabels(self._truth, measured=self._measured, end_m=self._trial.end_m)
        self._phases = self._planned()
        self._at = -1
        self._since_ns = setting.t_ns
        self._looked = False
        self._repeated = RepeatedImage()
        self._rows: list[NDArray[np.float32]] = []
        self._times_ns: list[int] = []

    def step(self, now: Situation) -> Wanted:
        """Return the current command. Raises DataError if the fingers are not open, or if no reference can be taken."""
        self._truth.sample(now.t_ns)
        if not self._looked and now.gripper is not None:
            self._require_open(now.gripper)
            self._looked = True
        if self._at < 0:
            if not (now.referenced and self._looked):
                if now.t_ns - self._since_ns > nanoseconds(REFERENCE_TIMEOUT_S):
                    raise DataError(
                        f"{self._trial.recording}: no settled image of the untouched gel (is the light steady?)"
                    )
                return Wanted("reference", twist=Twist(), acceleration_m_s2=self._task.lift_acceleration_m_s2)
            self._at, self._since_ns = 0, now.t_ns
        phase = self._phases[self._at]
        if self._is_over(phase, now):
            self._at, self._since_ns = self._at + 1, now.t_ns
            if self._at == len(self._phases):
                return Wanted("done", done=True)
            phase = self._phases[self._at]
        if now.pose is not None and self._measured and phase.poses_count:
            self._labels.see(now.pose)
        return Wanted(
            f"phase {self._at}",
            grip=phase.grip,
            twist=phase.twist,
            acceleration_m_s2=self._task.lift_acceleration_m_s2,
        )

    def _is_over(self, phase: _Phase, now: Situation) -> bool:
        """Raises SafetyStop if the fingers do not arrive, so that the arm does not lift without a grasp."""
        elapsed = now.t_ns - self._since_ns
        if elapsed < nanoseconds(phase.duration_s):
            return False
        if phase.grasps and not now.arrived:
            if elapsed > nanoseconds(phase.duration_s + self._task.timeout_s):
                raise SafetyStop(f"{self._trial.recording}: nothing was grasped: the gripper did not arrive")
            return False
        return True

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the recording's columns, after the run. Raises DataError without a usable frame."""
        if not self._rows:
            raise DataError(f"{self._trial.recording}: no frame could be used")
        t_s = [(t_ns - self._times_ns[0]) / NS_PER_S for t_ns in self._times_ns]
        labels = self._labels.at(self._times_ns)
        return from_rows(
            self._trial.recording, self._trial.object, self._trial.protocol, t_s, np.array(self._rows), labels
        )

    def keep(self, cycle: Cycle) -> None:
        """Record a frame of the first finger, as an observer of the engine.

        Frames before the approach and repeated images are left out.
        """
        frame = cycle.frame
        if self._at < 0 or not cycle.leads or self._repeated.seen(frame.image):
            return
        self._rows.append(signals_of(cycle.observation, brightness(frame)))
        self._times_ns.append(frame.t_ns)
        if self._also is not None:
            self._also(cycle)

    def _planned(self) -> list[_Phase]:
        """Return the phases: approach fast, close slowly, then the trial's moves; poses are used from the closing
        on."""
        thickness = self._trial.grip_aperture_m + APPROACH_M
        still = Twist()
        phases = [
            _Phase(1.0, self._grip(thickness, FAST_M_S), still, poses_count=False, grasps=True),
            _Phase(
                APPROACH_M / SLOW_CLOSING_M_S + 0.2,
                self._grip(self._trial.grip_aperture_m, SLOW_CLOSING_M_S),
                still,
                grasps=True,
            ),
        ]
        for move in self._trial.moves:
            grip = None if move.aperture_m is None else self._grip(move.aperture_m, move.closing_m_s)
            twist = Twist((0.0, 0.0, move.velocity_m_s), (0.0, move.turn_rad_s, 0.0))
            phases.append(_Phase(move.duration_s, grip, twist))
        return [*phases, _Phase(0.1, None, still)]

    def _grip(self, aperture_m: float, speed_m_s: float) -> Grip:
        return Grip(min(max(aperture_m, 0.0), self._stroke_m), speed_m_s, self._task.grip_force_n)

    def _require_open(self, state: GripperState) -> None:
        """Raise DataError if the fingers are closer: an object between them may touch the gel."""
        thickness = self._trial.grip_aperture_m + APPROACH_M
        if state.aperture_m < min(thickness, self._stroke_m - APPROACH_M):
            raise DataError(
                f"{self._trial.recording}: the fingers are {state.aperture_m * 1e3:.1f} mm apart; they must "
                f"start at least {thickness * 1e3:.1f} mm apart (open them)"
            )


def trial_job(options: TrialOptions, context: BuildContext) -> TrialJob:
    """Factory of the job backend `trial`. Raises ConfigError if the protocol has no such recording."""
    planned = trials(options.protocol, None, context.seed)
    if options.number >= len(planned):
        issue = ConfigIssue(
            "job.trial.number", f"{options.protocol} has {len(planned)} recordings", "choose a lower one"
        )
        raise ConfigError("the job", [issue])
    return TrialJob(planned[options.number], measured=False)
