"""Job `slide`: grasp an object that stands or is clamped, and move the fingers along it, or turn them about it.

That is how a peg that meets the bottom of its hole, or a lever that leans on a stop, moves through the fingers: the arm
sets the speed, and the grip lets it happen.
"""

from __future__ import annotations

import math

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import nanoseconds
from lsds.contracts import BuildContext, Setting, Situation, Slide, Twist, Wanted
from lsds.errors import ConfigError, ConfigIssue
from lsds.jobs.grasp import GRASP_STAGES, Grasping, begin_grasp


class SlideOptions(BaseModel):
    """Options of `[job.slide]`; grip and acceleration are those of `[task]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    speed_m_s: float = Field(default=-0.01, ge=-0.2, le=0.2, description="speed of the fingers along the object, up")
    turn_rad_s: float = Field(
        default=0.0, ge=-2, le=2, description="rate at which they turn about the axis that they close along"
    )
    slide_s: float = Field(default=2.0, gt=0, le=60, description="how long they slide or turn")
    hold_s: float = Field(default=0.5, ge=0, le=60, description="how long to hold still afterwards")


class SlideJob:
    """A `Job` for a gripper and an arm: reference, grasp, settle, slide, hold."""

    stages = (*GRASP_STAGES, "settle", "slide", "hold", "done")

    def __init__(self, options: SlideOptions | None = None, context: BuildContext | None = None) -> None:
        self._options = options or SlideOptions()

    def begin(self, setting: Setting) -> None:
        """Start with the gel without contact. Raises ConfigError without a gripper or an arm."""
        if setting.gripper is None or setting.arm is None:
            issue = ConfigIssue("gripper.backend, arm.backend", "job 'slide' needs a gripper and an arm", "choose both")
            raise ConfigError("the rig", [issue])
        own = self._options
        self._acceleration = setting.task.lift_acceleration_m_s2
        self._grasp: Grasping | None = begin_grasp(setting.task, setting)
        self._touch_m = self._touch_std_m = math.nan
        self._stages = [("settle", setting.task.settle_s), ("slide", own.slide_s), ("hold", own.hold_s)]
        self._ends_ns = 0

    def step(self, now: Situation) -> Wanted:
        """Return the wanted motion and grip. Raises SafetyStop if reference or grasp takes too long."""
        if self._grasp is not None:
            if not self._grasp.step(now):
                return Wanted(self._grasp.stage, grip=self._grasp.grip)
            self._touch_m, self._touch_std_m = self._grasp.touch_m, self._grasp.touch_std_m
            self._grasp, self._ends_ns = None, now.t_ns + nanoseconds(self._stages[0][1])
        while now.t_ns >= self._ends_ns:
            self._stages.pop(0)
            if not self._stages:
                return Wanted("done", done=True)
            self._ends_ns += nanoseconds(self._stages[0][1])
        stage, _ = self._stages[0]
        if stage == "settle":
            return Wanted(stage)
        own, slides = self._options, stage == "slide"
        return Wanted(
            stage,
            corrects=True,
            twist=Twist((0.0, 0.0, own.speed_m_s), (0.0, own.turn_rad_s, 0.0)) if slides else Twist(),
            acceleration_m_s2=self._acceleration,
            touch_m=self._touch_m,
            touch_std_m=self._touch_std_m,
            slide=Slide(abs(own.speed_m_s), abs(own.turn_rad_s)) if slides else None,
        )
