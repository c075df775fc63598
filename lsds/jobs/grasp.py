"""The first part of most jobs: take the reference of the gel without contact, then close on the object.

`begin_grasp` returns the way that `[task]` asks for: to an aperture, or by touch.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from lsds.clock import nanoseconds
from lsds.contracts import Grip
from lsds.contracts.job import TOUCH_STD_M
from lsds.errors import SafetyStop
from lsds.jobs.find_touch import TouchGrasp
from lsds.tactile.touch import TouchFinder

if TYPE_CHECKING:
    from lsds.contracts import Setting, Situation
    from lsds.contracts.task import TaskOptions


GRASP_STAGES = ("reference", "approach", "back off", "touch", "squeeze", "grasp")
"""Names of the stages of both ways to grasp."""


class Grasping(Protocol):
    """A grasp at work."""

    @property
    def stage(self) -> str:
        """Name of the stage."""
        ...

    @property
    def grip(self) -> Grip | None:
        """The grip wanted now, None to leave the fingers."""
        ...

    @property
    def touch_m(self) -> float:
        """Aperture at touch, m; NaN if not known."""
        ...

    @property
    def touch_std_m(self) -> float:
        """Standard deviation of that aperture, m."""
        ...

    def step(self, now: Situation) -> bool:
        """Advance; return whether the object is grasped. Raises SafetyStop where it cannot be."""
        ...


def begin_grasp(task: TaskOptions, setting: Setting) -> Grasping:
    """Return the grasp that `[task]` asks for. A rig without a gripper grasps nothing, to an aperture."""
    if task.grasp == "touch" and setting.gripper is not None:
        return TouchGrasp(task, setting.gripper, setting)
    return Grasp(task, setting)


class Grasp:
    """The stages "reference" and "grasp": close to the aperture of the `[task]` table."""

    def __init__(self, task: TaskOptions, setting: Setting) -> None:
        self._wanted = Grip(task.grip_aperture_m, task.grip_speed_m_s, task.grip_force_n)
        self.stage = "reference"
        self._timeout_s = task.timeout_s
        self._since_ns = setting.t_ns
        self._finder = TouchFinder(setting.fingers, setting.t_ns)

    @property
    def grip(self) -> Grip | None:
        """The grip wanted now."""
        return self._wanted if self.stage == "grasp" else None

    @property
    def touch_m(self) -> float:
        """Aperture at touch, m; NaN where none was seen."""
        return max(self._finder.touch_m, self._wanted.aperture_m) if self._finder.frames else math.nan

    @property
    def touch_std_m(self) -> float:
        """Standard deviation of that aperture, m."""
        return TOUCH_STD_M

    def step(self, now: Situation) -> bool:
        """Advance the stage; return whether the object is grasped. Raises SafetyStop if a stage takes too long."""
        self._finder.see(now)
        if self.stage == "reference" and now.referenced:
            self.stage, self._since_ns = "grasp", now.t_ns
        elif self.stage == "grasp" and now.arrived:
            return True
        if now.t_ns - self._since_ns > nanoseconds(self._timeout_s):
            what = "no reference frame" if self.stage == "reference" else "nothing was grasped: no arrival"
            raise SafetyStop(f"task: {what} within {self._timeout_s} s (raise task.timeout_s if that is normal)")
        return False
