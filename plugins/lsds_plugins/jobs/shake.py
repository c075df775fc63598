"""Job `shake`: grip firmly, hold still, lift, shake, and set down again: the load changes and nothing slips.

It shows what a detector calls slip that is none. `lsds calibrate slip` runs it, and a run's false alarms are its
corrections.
"""

from __future__ import annotations

from typing import NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import nanoseconds
from lsds.contracts import BuildContext, Grip, Setting, Situation, Twist, Wanted
from lsds.jobs.grasp import Grasp


class ShakeOptions(BaseModel):
    """Options of `[job.shake]`; grip, lifting speed and acceleration are those of `[task]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    closer_mm: float = Field(
        default=2.5, ge=0, le=50, description="how far to close beyond task.grip_aperture_m, to hold firmly"
    )
    still_s: float = Field(default=4.0, ge=0, le=600, description="how long to hold still before and after")
    lift_s: float = Field(default=1.0, gt=0, le=60, description="how long to lift, and to lower")
    shakes: int = Field(default=6, ge=1, le=1000, description="strokes up and down at each rate")
    rates_hz: list[float] = Field(default=[1.0, 2.0, 3.0], min_length=1, description="strokes up and down per second")
    speed_m_s: float = Field(default=0.08, gt=0, le=1, description="speed of a stroke")
    corrects: bool = Field(default=False, description="let the controller close on slip while the object is lifted")


class _Part(NamedTuple):
    stage: str
    duration_s: float
    velocity_m_s: float


class ShakeJob:
    """A `Job` for a gripper and an arm. The object ends where it began, on the table, in the grip."""

    def __init__(self, options: ShakeOptions | None = None, context: BuildContext | None = None) -> None:
        self._options = options or ShakeOptions()

    def begin(self, setting: Setting) -> None:
        """Start with the gel without contact."""
        own, task = self._options, setting.task
        firm = task.model_copy(update={"grip_aperture_m": max(0.0, task.grip_aperture_m - own.closer_mm * 1e-3)})
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
            _Part("lower", own.lift_s, -task.lift_speed_m_s),
            _Part("still", own.still_s, 0.0),
        )
        self._grasp: Grasp | None = Grasp(firm, setting.t_ns)
        self._at, self._since_ns = 0, setting.t_ns

    def step(self, now: Situation) -> Wanted:
        """Return what is wanted now. Raises SafetyStop if reference or grasp takes too long."""
        if self._grasp is not None:
            if not self._grasp.step(now):
                grip: Grip | None = self._grasp.grip if self._grasp.stage == "grasp" else None
                return Wanted(self._grasp.stage, grip=grip)
            self._grasp, self._since_ns = None, now.t_ns
        while now.t_ns - self._since_ns >= nanoseconds(self._parts[self._at].duration_s):
            self._since_ns += nanoseconds(self._parts[self._at].duration_s)
            self._at += 1
            if self._at == len(self._parts):
                return Wanted("done", done=True)
        part = self._parts[self._at]
        return Wanted(
            part.stage,
            corrects=self._options.corrects and part.stage != "still",
            twist=Twist(linear_m_s=(0.0, 0.0, part.velocity_m_s)),
            acceleration_m_s2=2 * self._acceleration if part.stage == "shake" else self._acceleration,
        )
