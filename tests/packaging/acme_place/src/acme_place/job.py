"""Lift the object, put it down again, release it."""

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import Grip, Twist, Wanted


class PlaceOptions(BaseModel):
    """Options of `[job.place]`."""

    model_config = ConfigDict(extra="forbid")

    height_m: float = Field(default=0.03, gt=0, le=0.1, description="how far to lift")


class PlaceJob:
    """Grasp, lift, lower, release. The controller reacts to slip meanwhile."""

    def __init__(self, options, context):
        self._height_m = options.height_m

    def begin(self, setting):
        """Begin with the untouched gel."""
        self._task, self._grasped_ns, self._open = setting.task, None, None

    def step(self, now):
        """Return the wanted motion and grip."""
        task = self._task
        if not now.referenced:
            return Wanted("look")
        if self._grasped_ns is None:
            if not now.arrived:
                return Wanted("close", grip=Grip(task.grip_aperture_m, task.grip_speed_m_s, task.grip_force_n))
            self._grasped_ns, self._floor_m = now.t_ns, now.arm.tcp_pose.position_m[2]
        if self._open is not None:
            return Wanted("open", grip=self._open, done=now.arrived)
        way_s = self._height_m / task.lift_speed_m_s
        if now.t_ns - self._grasped_ns < 1e9 * way_s:
            return Wanted("up", corrects=True, twist=Twist((0.0, 0.0, task.lift_speed_m_s)))
        # The object may have slipped while it was lifted: what lifts the fingers' height is where the table is.
        if now.arm.tcp_pose.position_m[2] > self._floor_m:
            return Wanted("down", corrects=True, twist=Twist((0.0, 0.0, -0.5 * task.lift_speed_m_s)))
        self._open = Grip(now.gripper.aperture_m + 0.01, task.grip_speed_m_s, task.grip_force_n)
        return Wanted("open", grip=self._open)
