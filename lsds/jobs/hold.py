"""Job `hold`: grip the object and hold it until `let_go`. Another program controls the arm.

Use it inside your own robot program: the program moves the arm, the engine corrects slip.

    with lsds.bring_up("rig.toml", job=job) as engine, engine.background() as grip:
        ...                # the arm program
        job.let_go()
        grip.wait(5.0)     # until the fingers are open: leaving the body ends the run at once
"""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import nanoseconds
from lsds.contracts import BuildContext, Grip, Setting, Situation, Wanted
from lsds.errors import ConfigError, ConfigIssue, SafetyStop
from lsds.jobs.grasp import GRASP_STAGES, begin_grasp


class HoldOptions(BaseModel):
    """Options of `[job.hold]`; the grip is set in `[task]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    release_m: float = Field(default=0.01, gt=0, le=0.5, description="how far to open the fingers on release")
    duration_s: float = Field(default=0.0, ge=0, le=1e6, description="release after this time; 0: only on let_go()")


class HoldJob:
    """A `Job` that never commands the arm. `held` is true from the end of the grasp until `let_go`."""

    stages = (*GRASP_STAGES, "hold", "release")

    def __init__(self, options: HoldOptions | None = None, context: BuildContext | None = None) -> None:
        options = options or HoldOptions()
        self._release_m = options.release_m
        self._duration_ns = nanoseconds(options.duration_s)
        self._let_go = False
        self.held = False

    def begin(self, setting: Setting) -> None:
        """Start with the gel without contact. Raises ConfigError without a gripper."""
        if setting.gripper is None:
            raise ConfigError(
                "the rig", [ConfigIssue("gripper.backend", "job 'hold' needs a gripper", "choose a gripper backend")]
            )
        self._task, self._gripper = setting.task, setting.gripper
        self._grasp = begin_grasp(setting.task, setting)
        self._opening: Grip | None = None
        # `let_go` may have been called already, from the thread that has started this run: it counts.
        self.held = False

    def let_go(self) -> None:
        """Open the fingers and end the job; from any thread. If nothing is held yet, it ends the job without moving."""
        self._let_go = True

    def step(self, now: Situation) -> Wanted:
        """Return what is wanted now."""
        if self._opening is not None:
            if now.t_ns - self._released_ns > nanoseconds(self._task.timeout_s):
                raise SafetyStop(
                    f"hold: the fingers did not open within {self._task.timeout_s:g} s (are they blocked?)"
                )
            return Wanted("release", grip=self._opening, done=now.arrived)
        if not self.held and not self._let_go:
            self.held, self._held_ns = self._grasp.step(now), now.t_ns
        if self.held and 0 < self._duration_ns <= now.t_ns - self._held_ns:
            self._let_go = True
        if self._let_go:
            return self._release(now)
        if self.held:
            return Wanted("hold", corrects=True, touch_m=self._grasp.touch_m, touch_std_m=self._grasp.touch_std_m)
        return Wanted(self._grasp.stage, grip=self._grasp.grip)

    def _release(self, now: Situation) -> Wanted:
        held, self.held, self._let_go = self.held, False, False
        if now.gripper is None or not held:
            return Wanted("release", done=True)
        aperture = min(now.gripper.aperture_m + self._release_m, self._gripper.stroke_m)
        self._released_ns = now.t_ns
        self._opening = Grip(aperture, self._task.grip_speed_m_s, self._task.grip_force_n)
        return Wanted("release", grip=self._opening)
