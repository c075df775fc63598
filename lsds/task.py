"""The job of a run: look at the untouched gel, grasp, settle, lift, hold. Says which stage it is at any time."""

from __future__ import annotations

from enum import Enum

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import nanoseconds
from lsds.errors import SafetyStop


class TaskOptions(BaseModel):
    """Options of the `[task]` table. The default is the paper's demonstration: lift a PVC pipe at 3.8 cm/s."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    grip_aperture_m: float = Field(default=0.0236, ge=0, le=0.5, description="aperture to grasp with")
    grip_speed_m_s: float = Field(default=0.05, gt=0, le=1, description="finger speed of grasping and correcting")
    grip_force_n: float = Field(default=60.0, gt=0, le=500, description="most that the gripper may push with")
    lift_speed_m_s: float = Field(default=0.038, ge=0, le=1, description="vertical TCP velocity while lifting")
    lift_acceleration_m_s2: float = Field(default=0.5, gt=0, le=20, description="of the start and end of the lift")
    settle_s: float = Field(default=0.6, ge=0, le=60, description="wait between grasp and lift")
    lift_s: float = Field(default=3.0, ge=0, le=600, description="how long to lift")
    hold_s: float = Field(default=1.0, ge=0, le=600, description="how long to hold still afterwards")
    timeout_s: float = Field(default=10.0, gt=0, le=600, description="most that reference or grasp may take")


class Stage(Enum):
    """Where the job is. The loop corrects the grip in LIFT and HOLD only."""

    REFERENCE = "reference"
    GRASP = "grasp"
    SETTLE = "settle"
    LIFT = "lift"
    HOLD = "hold"
    DONE = "done"


ACTING = (Stage.LIFT, Stage.HOLD)
"""The stages in which slip is answered."""


class LiftTask:
    """The stages in order. `advance` is told what has happened and moves on by time and by events."""

    def __init__(self, options: TaskOptions, start_ns: int) -> None:
        self.options = options
        self.stage = Stage.REFERENCE
        self.since_ns = start_ns
        self.lift_began_ns: int | None = None

    @property
    def corrects_grip(self) -> bool:
        """Whether slip is answered at this stage."""
        return self.stage in ACTING

    @property
    def lift_speed_m_s(self) -> float:
        """Vertical TCP velocity wanted now."""
        return self.options.lift_speed_m_s if self.stage is Stage.LIFT else 0.0

    def reference_taken(self, now_ns: int) -> None:
        """Go on to grasping."""
        self._enter(Stage.GRASP, now_ns)

    def advance(self, now_ns: int, grasped: bool) -> Stage:
        """Return the stage at `now_ns`; `grasped` tells whether the gripper has done what it was sent to do.

        Raises SafetyStop where reference or grasp took too long.
        """
        elapsed = now_ns - self.since_ns
        if self.stage in (Stage.REFERENCE, Stage.GRASP) and elapsed > nanoseconds(self.options.timeout_s):
            what = "no reference frame" if self.stage is Stage.REFERENCE else "nothing was grasped: no arrival"
            raise SafetyStop(f"task: {what} within {self.options.timeout_s} s (raise task.timeout_s if that is normal)")
        if self.stage is Stage.GRASP and grasped:
            self._enter(Stage.SETTLE, now_ns)
        elif self.stage is Stage.SETTLE and elapsed >= nanoseconds(self.options.settle_s):
            self._enter(Stage.LIFT, now_ns)
            self.lift_began_ns = now_ns
        elif self.stage is Stage.LIFT and elapsed >= nanoseconds(self.options.lift_s):
            self._enter(Stage.HOLD, now_ns)
        elif self.stage is Stage.HOLD and elapsed >= nanoseconds(self.options.hold_s):
            self._enter(Stage.DONE, now_ns)
        return self.stage

    def _enter(self, stage: Stage, now_ns: int) -> None:
        self.stage, self.since_ns = stage, now_ns
