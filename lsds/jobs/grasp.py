"""The first part of most jobs: take the reference of the gel without contact, then close on the object."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.contracts import Grip
from lsds.errors import SafetyStop

if TYPE_CHECKING:
    from lsds.contracts import Situation
    from lsds.task import TaskOptions


class Grasp:
    """The stages "reference" and "grasp", starting at `start_ns`, with the parameters of the `[task]` table."""

    def __init__(self, task: TaskOptions, start_ns: int) -> None:
        self.grip = Grip(task.grip_aperture_m, task.grip_speed_m_s, task.grip_force_n)
        self.stage = "reference"
        self._timeout_s = task.timeout_s
        self._since_ns = start_ns

    def step(self, now: Situation) -> bool:
        """Advance the stage; return whether the object is grasped. Raises SafetyStop if a stage takes too long."""
        if self.stage == "reference" and now.referenced:
            self.stage, self._since_ns = "grasp", now.t_ns
        elif self.stage == "grasp" and now.arrived:
            return True
        if now.t_ns - self._since_ns > nanoseconds(self._timeout_s):
            what = "no reference frame" if self.stage == "reference" else "nothing was grasped: no arrival"
            raise SafetyStop(f"task: {what} within {self._timeout_s} s (raise task.timeout_s if that is normal)")
        return False
