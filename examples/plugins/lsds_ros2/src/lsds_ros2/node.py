"""The node: publishers of fingertip and grip, an action server of the gripper, a subscriber of velocities."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import lsds
from lsds.clock import nanoseconds, seconds

from control_msgs.action import GripperCommand
from geometry_msgs.msg import TwistStamped, WrenchStamped
from lsds_ros2.messages import image_of, twist_of, wrench_of
from lsds_ros2.running import Running
from lsds_ros2.serve import STALE_S, GripGoal, Serve
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time
from sensor_msgs.msg import Image
from std_msgs.msg import Float32

if TYPE_CHECKING:
    from collections.abc import Sequence

PUBLISH_HZ = 50.0
"""Rate of looking for a new frame to publish (Hz): twice that of a usual fingertip."""
FEEDBACK_S = 0.02
"""Interval of the feedback of a goal (s)."""
BASE_FRAMES = ("", "base", "base_link")
"""Frames of a velocity that are taken as the base of the arm; lsds transforms nothing."""
AHEAD_S = 0.05
"""A velocity that is stamped further ahead of the node's clock than this uses another clock (s)."""


class LsdsNode(Node):
    """Runs a rig, in real time or in simulated time, until `close`.

    An error ends the run; the timer raises it, goals are aborted, and the grip is kept.
    """

    def __init__(self, rig: str = "", overrides: Sequence[str] = ()) -> None:
        """Bring the rig up, with nothing between the fingers. Raises ConfigError, BringUpError, SafetyStop."""
        self._job = Serve()
        self._running = Running(rig, overrides, self._job)
        super().__init__("lsds")
        self._running.start()
        engine = self._running.engine
        gripper = engine.rig.gripper
        self._stroke_m = 0.0 if gripper is None else gripper.spec.stroke_m
        self._published_ns, self._closed = -1, False
        # A goal runs for seconds, and the timer and cancellations must come meanwhile.
        group = ReentrantCallbackGroup()
        names = [finger.name for finger in engine.rig.fingers]
        self._images = {
            name: self.create_publisher(Image, f"~/{name}/image", qos_profile_sensor_data) for name in names
        }
        self._loads = {name: self.create_publisher(WrenchStamped, f"~/{name}/load", 10) for name in names}
        self._values = {
            name: self.create_publisher(Float32, f"~/{name}", 10)
            for name in ("slip_probability", "slip_speed", "aperture")
        }
        self.create_subscription(TwistStamped, "~/twist", self.on_twist, 1)
        self._server = ActionServer(
            self,
            GripperCommand,
            "~/gripper_command",
            self.on_goal,
            callback_group=group,
            goal_callback=self.on_request,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        self.create_timer(1 / PUBLISH_HZ, self.on_timer)

    @property
    def engine(self) -> lsds.Engine:
        """The engine of the run."""
        return self._running.engine

    def close(self) -> None:
        """Stop everything, abort a goal, and keep the grip."""
        self._closed = True
        try:
            self._running.stop()
        finally:
            self._server.destroy()
            self.destroy_node()

    # -- what it publishes --------------------------------------------------------------------------------

    def on_timer(self) -> None:
        """Publish the newest frame and grip, once each. Raises the error that ended the run."""
        try:
            self._running.advance(1 / PUBLISH_HZ)
        except lsds.LsdsError as error:
            self.get_logger().error(f"the run has ended and the grip is kept: {error}")
            raise
        cycle = self._running.newest
        if cycle is None or cycle.t_ns == self._published_ns:
            return
        self._published_ns = cycle.t_ns
        for finger in cycle.fingers:
            stamp = self._stamp(finger.frame.t_ns)
            self._images[finger.finger].publish(image_of(finger, stamp))
            self._loads[finger.finger].publish(wrench_of(finger, stamp))
        speed = math.nan if cycle.estimate.abstained else cycle.estimate.speed_m_s
        for name, value in (
            ("slip_probability", cycle.grip.slips),
            ("slip_speed", speed),
            ("aperture", cycle.measured_m),
        ):
            self._values[name].publish(Float32(data=float(value)))

    def _stamp(self, t_ns: int) -> Any:
        """Return a time of the rig's clock on the clock of ROS."""
        now = self.get_clock().now()
        return Time(nanoseconds=now.nanoseconds - (self.engine.rig.clock.now() - t_ns)).to_msg()

    # -- what it takes ------------------------------------------------------------------------------------

    def on_twist(self, message: TwistStamped) -> None:
        """Move the arm until the velocity is stale. One that cannot be used stops the arm."""
        twist, age_s = lsds.Twist(), 0.0
        problem = self._problem_of(message)
        if not problem:
            try:
                twist, age_s = twist_of(message), max(self._age_s(message), 0.0)
            except ValueError as error:
                problem = str(error)
        if problem:
            self.get_logger().warning(f"~/twist: {problem}; the arm stops", throttle_duration_sec=1.0)
        self._job.drive(twist, self.engine.rig.clock.now() + nanoseconds(STALE_S - age_s))

    def _age_s(self, message: TwistStamped) -> float:
        """Return the age of a message by its stamp (s), 0 without one."""
        stamped_ns = Time.from_msg(message.header.stamp).nanoseconds
        return seconds(self.get_clock().now().nanoseconds - stamped_ns) if stamped_ns else 0.0

    def _problem_of(self, message: TwistStamped) -> str:
        frame, age_s = message.header.frame_id, self._age_s(message)
        if self.engine.rig.arm is None:
            return "the rig has no arm (choose an arm backend)"
        if frame not in BASE_FRAMES:
            return f"frame '{frame}' is not the base of the arm (transform it, and use 'base')"
        if age_s > STALE_S:
            return f"it is {age_s:.2f} s old, the limit is {STALE_S} s (check the network and both clocks)"
        if age_s < -AHEAD_S:
            return f"it is stamped {-age_s:.2f} s ahead (synchronise the clocks)"
        return ""

    def on_request(self, request: Any) -> Any:
        """Refuse a goal that is not an aperture of the gripper, and any after the run has ended."""
        position, effort = request.command.position, request.command.max_effort
        problem = ""
        if self._running.error is not None:
            problem = f"the run has ended: {self._running.error}"
        elif not (math.isfinite(position) and 0 <= position <= self._stroke_m):
            problem = f"position {position} m is not between 0 and {self._stroke_m:g} m"
        elif not (math.isfinite(effort) and effort >= 0):
            problem = f"max_effort {effort} N is not a force (0 means that of the task)"
        if not problem:
            return GoalResponse.ACCEPT
        self.get_logger().warning(f"~/gripper_command: goal refused: {problem}")
        return GoalResponse.REJECT

    def on_goal(self, handle: Any) -> Any:
        """Bring the fingers to a goal, and return the result when they rest. Only the goal itself can open them."""
        command = handle.request.command
        goal = GripGoal(float(command.position), float(command.max_effort))
        self._job.aim(goal)
        while not (goal.ended or self._closed or self._running.error):
            if handle.is_cancel_requested:
                self._job.cancel(goal)
            handle.publish_feedback(self._state(GripperCommand.Feedback(), goal))
            time.sleep(FEEDBACK_S)
        result = self._state(GripperCommand.Result(), goal)
        if goal.ended in ("reached", "stalled"):
            handle.succeed()
        elif goal.ended == "cancelled":
            handle.canceled()
        else:
            why = goal.ended or f"the run has ended: {self._running.error or 'the node was closed'}"
            self.get_logger().warning(f"~/gripper_command: goal aborted ({why}); the grip is kept")
            handle.abort()
        return result

    def _state(self, message: Any, goal: GripGoal) -> Any:
        """Fill feedback or result; `effort` is the force that the gripper may use, because none is measured."""
        cycle = self._running.newest
        message.position = math.nan if cycle is None else float(cycle.measured_m)
        message.effort = goal.force_n
        message.stalled, message.reached_goal = goal.ended == "stalled", goal.ended == "reached"
        return message
