"""Job `lift`, the paper's demonstration: take the reference, grasp, settle, lift, hold."""

from __future__ import annotations

import math

from lsds.contracts import BuildContext, Setting, Situation, Twist, Wanted
from lsds.jobs.grasp import Grasping, begin_grasp
from lsds.jobs.take_up import TakeUp


class LiftJob:
    """A `Job` in stages: reference, grasp, settle, lift, hold. Slip is corrected in the last two.

    After a grasp by touch the lift begins slowly, until the load is taken up; what that rises counts as lifted.

    In a simulated cell it ends when the object has dropped. Its options are in `[task]`.
    """

    def __init__(self, options: None = None, context: BuildContext | None = None) -> None: ...

    def begin(self, setting: Setting) -> None:
        """Start with the gel without contact."""
        self._task = task = setting.task
        self._cell = setting.cell
        #: Each timed stage with its duration (s), in order.
        self._stages = (("settle", task.settle_s), ("lift", task.lift_s), ("hold", task.hold_s))
        self._by_touch = task.grasp == "touch" and setting.gripper is not None
        self._take_up: TakeUp | None = None
        self._grasp: Grasping | None = begin_grasp(task, setting)
        self._touch_m = math.nan
        self._lifted_s = 0.0
        self._at = 0
        self._since_ns = setting.t_ns

    def step(self, now: Situation) -> Wanted:
        """Return what is wanted now. Raises SafetyStop if reference or grasp takes too long."""
        if self._grasp is not None:
            if not self._grasp.step(now):
                return Wanted(self._grasp.stage, grip=self._grasp.grip, done=self._dropped(now.t_ns))
            self._touch_m = self._grasp.touch_m
            self._grasp, self._since_ns = None, now.t_ns
        elif self._take_up is not None and not self._is_over(now):
            if self._take_up.step(now):
                self._lifted_s = self._elapsed_s(now)
                self._take_up, self._since_ns = None, now.t_ns
        elif self._is_over(now):
            self._at, self._since_ns, self._lifted_s = self._at + 1, now.t_ns, 0.0
            if self._at == len(self._stages):
                return Wanted("done", done=True)
            begins = self._stages[self._at][0] == "lift" and self._task.lift_s > 0
            slower = self._task.take_up_speed_m_s < self._task.lift_speed_m_s
            self._take_up = TakeUp(now.t_ns) if self._by_touch and begins and slower else None
        stage = self._stages[self._at][0]
        if stage == "settle":
            return Wanted(stage, done=self._dropped(now.t_ns))
        speed = self._task.lift_speed_m_s if stage == "lift" else 0.0
        if self._take_up is not None:
            stage, speed = "take up", min(speed, self._task.take_up_speed_m_s)
        return Wanted(
            stage,
            corrects=True,
            twist=Twist(linear_m_s=(0.0, 0.0, speed)),
            acceleration_m_s2=self._task.lift_acceleration_m_s2,
            done=self._dropped(now.t_ns),
            touch_m=self._touch_m,
        )

    def _is_over(self, now: Situation) -> bool:
        """Tell whether the present stage has had its time."""
        return self._lifted_s + self._elapsed_s(now) >= self._stages[self._at][1] - 1e-9

    def _elapsed_s(self, now: Situation) -> float:
        """Return the time since the stage began; of a slow lift, what the same height takes at lifting speed."""
        share = 1.0
        if self._take_up is not None:
            share = self._task.take_up_speed_m_s / self._task.lift_speed_m_s
        return share * (now.t_ns - self._since_ns) * 1e-9

    def _dropped(self, now_ns: int) -> bool:
        if self._cell is None:
            return False
        self._cell.advance(now_ns)
        return self._cell.truth().dropped
