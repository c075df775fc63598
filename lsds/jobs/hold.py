"""Job `hold`: grip what is there and keep it until told to let go. The arm is somebody else's.

This is the way lsds sits inside a robot program of one's own: the program moves the arm, the engine answers slip.

    with Engine(rig, job).background():
        ...                # the arm program
        job.let_go()
"""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext, Grip, Setting, Situation, Wanted
from lsds.errors import ConfigError, ConfigIssue
from lsds.jobs.grasp import Grasp


class HoldOptions(BaseModel):
    """Options of `[job.hold]`; how to grip is in `[task]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    release_m: float = Field(default=0.01, gt=0, le=0.5, description="how far to open the fingers on release")


class HoldJob:
    """A `Job` that never commands the arm. `held` is true from the end of the grasp until `let_go`."""

    def __init__(self, options: HoldOptions | None = None, context: BuildContext | None = None) -> None:
        self._release_m = (options or HoldOptions()).release_m
        self._let_go = False
        self.held = False

    def begin(self, setting: Setting) -> None:
        """Begin with the untouched gel. Raises ConfigError without a gripper."""
        if setting.gripper is None:
            raise ConfigError("the rig", [ConfigIssue("gripper.backend", "job 'hold' needs a gripper", "choose one")])
        self._task, self._gripper = setting.task, setting.gripper
        self._grasp = Grasp(setting.task, setting.t_ns)
        self._opening: Grip | None = None
        self._let_go = self.held = False

    def let_go(self) -> None:
        """Open the fingers and end the job; from any thread. Before anything is held it ends the job as it is."""
        self._let_go = True

    def step(self, now: Situation) -> Wanted:
        """Say what is wanted now."""
        if self._opening is not None:
            return Wanted("release", grip=self._opening, done=now.arrived)
        if self._let_go:
            return self._release(now)
        if not self.held:
            self.held = self._grasp.step(now)
        if self.held:
            return Wanted("hold", corrects=True)
        return Wanted(self._grasp.stage, grip=self._grasp.grip if self._grasp.stage == "grasp" else None)

    def _release(self, now: Situation) -> Wanted:
        held, self.held = self.held, False
        if now.gripper is None or not held:
            return Wanted("release", done=True)
        aperture = min(now.gripper.aperture_m + self._release_m, self._gripper.stroke_m)
        self._opening = Grip(aperture, self._task.grip_speed_m_s, self._task.grip_force_n)
        return Wanted("release", grip=self._opening)
