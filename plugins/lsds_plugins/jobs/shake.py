"""Job `shake`: grip firmly, hold still, lift, shake, and lower again: the load changes and nothing slips.

It shows the false alarms of a detector. `lsds calibrate slip` runs it on a simulated rig. With `corrects = true`, the
corrections of a run are its false alarms.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import nanoseconds
from lsds.contracts import BuildContext, Setting, Situation, Twist, Wanted
from lsds.errors import ConfigError, ConfigIssue
from lsds.jobs.grasp import GRASP_STAGES, Grasping, begin_grasp

CLEAR_M = 1e-3
"""Minimum height above the start at which the arm comes to rest, m; chosen."""
LOWERING_FACTOR = 10.0
"""Maximum duration of lowering as a multiple of that of lifting; chosen."""


class ShakeOptions(BaseModel):
    """Options of `[job.shake]`; grip, lifting speed and acceleration are those of `[task]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    closer_mm: float = Field(
        default=2.5, ge=0, le=50, description="how far to close beyond the grip of [task], to hold firmly"
    )
    still_s: float = Field(default=4.0, ge=0, le=600, description="how long to hold still before and after")
    lift_s: float = Field(default=1.0, gt=0, le=60, description="how long to lift")
    shakes: int = Field(default=6, ge=1, le=1000, description="strokes up and down at each rate")
    rates_hz: list[Annotated[float, Field(ge=0.5, le=10)]] = Field(
        default=[1.0, 2.0, 3.0], min_length=1, description="strokes up and down per second"
    )
    speed_m_s: float = Field(default=0.08, gt=0, le=0.2, description="speed of a stroke")
    corrects: bool = Field(default=False, description="let the controller close on slip while the object is lifted")


class _Part(NamedTuple):
    stage: str
    duration_s: float
    velocity_m_s: float


class ShakeJob:
    """A `Job` for a gripper and an arm. It ends slightly above where it began, with the object in the grip.

    Ramps make a stroke down longer or shorter than one up, so the measured height decides how far down the arm goes.
    """

    stages = (*GRASP_STAGES, "still", "lift", "shake", "lower", "done")

    def __init__(self, options: ShakeOptions | None = None, context: BuildContext | None = None) -> None:
        self._options = options or ShakeOptions()

    def begin(self, setting: Setting) -> None:
        """Start with the gel without contact. Raises ConfigError without a gripper or an arm."""
        if setting.gripper is None or setting.arm is None:
            issue = ConfigIssue("gripper.backend, arm.backend", "job 'shake' needs a gripper and an arm", "choose both")
            raise ConfigError("the rig", [issue])
        own, task = self._options, setting.task
        closer_m = own.closer_mm * 1e-3
        # `task.fragile_n` still limits the first squeeze, so a fragile object may be shaken in a weaker grip.
        firm = task.model_copy(
            update={
                "grip_aperture_m": max(0.0, task.grip_aperture_m - closer_m),
                "first_squeeze_m": task.first_squeeze_m + closer_m,
            }
        )
        self._acceleration = task.lift_acceleration_m_s2
        strokes = [
            _Part("shake", 0.5 / rate, sign * own.speed_m_s)
            for rate in own.rates_hz
            for _ in range(own.shakes)
            for sign in (1, -1)
        ]
        self._parts = (
            _Part("still", own.still_s, 0.0),
            _Part("lift", own.lift_s, task.lift_speed_m_s),
            *strokes,
            _Part("lower", LOWERING_FACTOR * own.lift_s, -task.lift_speed_m_s),
            _Part("still", own.still_s, 0.0),
        )
        self._grasp: Grasping | None = begin_grasp(firm, setting)
        self._touch_m = self._touch_std_m = math.nan
        self._at, self._since_ns = 0, setting.t_ns
        self._floor_m: float | None = None

    def step(self, now: Situation) -> Wanted:
        """Return the wanted motion and grip. Raises SafetyStop if reference or grasp takes too long."""
        if self._grasp is not None:
            if not self._grasp.step(now):
                return Wanted(self._grasp.stage, grip=self._grasp.grip)
            self._touch_m, self._touch_std_m = self._grasp.touch_m, self._grasp.touch_std_m
            self._grasp, self._since_ns = None, now.t_ns
        height_m = None if now.arm is None else now.arm.tcp_pose.position_m[2]
        if self._floor_m is None:
            self._floor_m = height_m
        while self._is_over(self._parts[self._at], height_m, now.t_ns):
            self._at, self._since_ns = self._at + 1, now.t_ns
            if self._at == len(self._parts):
                return Wanted("done", done=True)
        part = self._parts[self._at]
        velocity = 0.0 if part.velocity_m_s < 0 and self._is_low(part, height_m) else part.velocity_m_s
        return Wanted(
            part.stage,
            corrects=self._options.corrects and part.stage != "still",
            twist=Twist(linear_m_s=(0.0, 0.0, velocity)),
            acceleration_m_s2=self._acceleration_of(part),
            touch_m=self._touch_m,
            touch_std_m=self._touch_std_m,
        )

    def _is_over(self, part: _Part, height_m: float | None, now_ns: int) -> bool:
        late = now_ns - self._since_ns >= nanoseconds(part.duration_s)
        return late or (part.stage == "lower" and self._is_low(part, height_m))

    def _is_low(self, part: _Part, height_m: float | None) -> bool:
        """Return whether the descending arm has to stop now to stay above where it began."""
        if height_m is None or self._floor_m is None:
            return True
        stopping_m = part.velocity_m_s**2 / (2 * self._acceleration_of(part))
        # The arm moves this far before it receives the command to stop.
        heard_m = abs(part.velocity_m_s) * HEARD_S
        return height_m - self._floor_m <= CLEAR_M + stopping_m + heard_m

    def _acceleration_of(self, part: _Part) -> float:
        return 2 * self._acceleration if part.stage == "shake" else self._acceleration


HEARD_S = 0.05
"""Age of a measured height, and of a command when the arm follows it, s; chosen."""
