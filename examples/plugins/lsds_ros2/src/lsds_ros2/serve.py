"""The job of the engine: grip goals and arm velocities that other programs send, with slip corrected meanwhile."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass

import lsds
from lsds.clock import nanoseconds
from lsds.contracts import Contact
from lsds.errors import ConfigError, ConfigIssue

STALE_S = 0.2
"""A velocity that is older than this stops the arm (s)."""
CONTACT_SHARE = 0.02
"""The gel is in contact with the object if at least this share of its image is indented."""
REACTION_S = 0.1
"""Time (s), with the gripper's latency, in which fingers still close after a cancelled goal; to stop earlier they would
have to open again."""


@dataclass(eq=False)
class GripGoal:
    """A wanted aperture (m) with at most a force (N; 0: that of the task), and its outcome.

    `ended` is "" while the fingers move, then "reached" at the aperture, "stalled" on an object, "replaced" by another
    goal, "cancelled", or "late" after `task.timeout_s`.
    """

    aperture_m: float
    force_n: float = 0.0
    ended: str = ""
    began_ns: int | None = None


class Serve:
    """A `Job`: "reference" without contact, "idle" until the first goal, then "move" and "hold".

    While an object is held, the controller closes the fingers on slip, and a goal that still squeezes the object never
    opens them. Only a goal wider than the aperture at touch releases it; no cancelled, late or replaced goal does.
    """

    stages = ("reference", "idle", "move", "hold")

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._goal: GripGoal | None = None
        self._cancels = False
        self._twist: lsds.Twist | None = None
        self._twist_until_ns = 0

    def begin(self, setting: lsds.Setting) -> None:
        """Start a run. Raises ConfigError without a gripper."""
        if setting.gripper is None:
            issue = ConfigIssue("gripper.backend", "the node needs a gripper", "choose a gripper backend")
            raise ConfigError("node lsds", [issue])
        self._task, self._spec = setting.task, setting.gripper
        self._has_arm = setting.arm is not None
        self._grip: lsds.Grip | None = None
        self._touch_m = math.nan
        self._holds = False

    # -- from any thread ----------------------------------------------------------------------------------

    def aim(self, goal: GripGoal) -> None:
        """Make a goal the present one; the goal before is replaced."""
        with self._lock:
            if self._goal is not None and not self._goal.ended:
                self._goal.ended = "replaced"
            self._goal, self._cancels = goal, False

    def cancel(self, goal: GripGoal) -> None:
        """End the motion to a goal. Fingers that close on an object go on, because it needs the grip."""
        with self._lock:
            if goal is self._goal and not goal.ended:
                self._cancels = True

    def drive(self, twist: lsds.Twist, until_ns: int) -> None:
        """Move the arm with a velocity in the base frame until a time of the rig's clock, then hold it still."""
        with self._lock:
            self._twist, self._twist_until_ns = twist, until_ns

    # -- from the engine ----------------------------------------------------------------------------------

    def step(self, now: lsds.Situation) -> lsds.Wanted:
        """Return what is wanted now."""
        if not now.referenced or now.gripper is None:
            return lsds.Wanted("reference")
        with self._lock:
            self._find_touch(now)
            moved = self._begin_goal(now)
            if not moved:
                self._end_goal(now)
            twist = self._velocity(now.t_ns)
        if self._grip is None:
            return lsds.Wanted("idle", twist=twist)
        stage = "hold" if self._holds else "move"
        return lsds.Wanted(stage, grip=self._grip, corrects=self._holds, twist=twist, touch_m=self._touch_m)

    def _begin_goal(self, now: lsds.Situation) -> bool:
        """Start the motion to a new goal; return whether there is one."""
        goal = self._goal
        if goal is None or goal.ended or goal.began_ns is not None:
            return False
        goal.began_ns = now.t_ns
        if self._holds:
            held_m = math.nan if now.cycle is None else now.cycle.held_m
            if goal.aperture_m > self._touch_m:
                self._holds, self._touch_m = False, math.nan
            elif not goal.aperture_m < held_m:
                # The controller has closed farther than that, and decides about the squeeze.
                goal.ended = "stalled"
                return False
        self._grip = self._to(goal.aperture_m, goal.force_n)
        return True

    def _end_goal(self, now: lsds.Situation) -> None:
        """Note that the fingers have arrived; stop them if the goal was cancelled or takes too long."""
        goal, state = self._goal, now.gripper
        if goal is None or goal.ended or goal.began_ns is None or state is None:
            return
        touches, near_m = math.isfinite(self._touch_m), 2 * self._spec.resolution_m
        # The controller may have closed beyond the goal on the way there.
        beyond = self._holds and not state.moving and state.aperture_m <= goal.aperture_m + near_m
        if now.arrived or beyond:
            self._holds = self._holds or touches
            near = abs(state.aperture_m - goal.aperture_m) <= near_m
            goal.ended = "stalled" if self._holds or state.contact is Contact.CLOSING or not near else "reached"
            return
        late = now.t_ns - goal.began_ns > nanoseconds(self._task.timeout_s)
        if not (late or self._cancels):
            return
        goal.ended, self._cancels = "late" if late else "cancelled", False
        if goal.aperture_m > state.aperture_m:
            self._grip = self._to(state.aperture_m, goal.force_n)
        elif not touches:
            coast_m = self._task.grip_speed_m_s * (self._spec.latency_s + REACTION_S)
            self._grip = self._to(max(goal.aperture_m, state.aperture_m - coast_m), goal.force_n)

    def _to(self, aperture_m: float, force_n: float) -> lsds.Grip:
        return lsds.Grip(aperture_m, self._task.grip_speed_m_s, force_n or self._task.grip_force_n)

    def _find_touch(self, now: lsds.Situation) -> None:
        """Note the aperture at which the gel first shows the object; hold it once the fingers rest."""
        if self._holds or now.cycle is None or self._grip is None:
            return
        shares = [0.0 if f.observation.contact is None else f.observation.contact.area_fraction for f in now.fingers]
        if max(shares, default=0.0) < CONTACT_SHARE:
            self._touch_m = math.nan
            return
        if math.isnan(self._touch_m):
            # The frame is older than the newest state of the gripper, so the aperture is that of the frame.
            self._touch_m = now.cycle.grip.aperture_m
        goal = self._goal
        if now.arrived and goal is not None and goal.ended in ("cancelled", "late"):
            self._holds = True

    def _velocity(self, t_ns: int) -> lsds.Twist | None:
        """Return the velocity for the arm: zero once the newest is stale, None before the first."""
        if self._twist is None or not self._has_arm:
            return None
        return self._twist if t_ns < self._twist_until_ns else lsds.Twist()
