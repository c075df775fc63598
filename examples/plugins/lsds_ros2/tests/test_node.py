"""The node in the simulated cell, without ROS 2 and without hardware."""

from __future__ import annotations

import itertools
import math
import re
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from lsds.errors import ConfigError, DeviceFault, SafetyStop

import rclpy
from control_msgs.action import GripperCommand
from geometry_msgs.msg import TwistStamped
from lsds_ros2.main import main
from lsds_ros2.node import LsdsNode
from lsds_ros2.parameters import parameters
from rclpy.action import ServerGoalHandle
from rclpy.node import Node
from rclpy.world import PARAMETERS, TOPICS

FAST = ["cell.simulated.fidelity=winkler"]
STROKE_M, GRIP_M = 0.05, 0.0236
"""Stroke of the simulated gripper, and an aperture that squeezes the simulated pipe by a little (m)."""
END_S = 20.0
"""Time limit of a goal on a busy machine (s)."""


@pytest.fixture
def node() -> Iterator[LsdsNode]:
    rclpy.init()
    node = LsdsNode(overrides=FAST)
    yield node
    node.close()
    rclpy.try_shutdown()


def heard(topic: str) -> list[Any]:
    """Return the list in which the messages of a topic will be."""
    messages: list[Any] = []
    TOPICS.setdefault(topic, []).append(messages.append)
    return messages


def send(node: LsdsNode, position: float, max_effort: float = 0.0) -> ServerGoalHandle | None:
    goal = GripperCommand.Goal()
    goal.command.position, goal.command.max_effort = position, max_effort
    return node._server.standin_send(goal)


def started(node: LsdsNode, position: float) -> ServerGoalHandle:
    """Send a goal, and return its handle once the job has it."""
    handle = send(node, position)
    assert handle is not None
    goal_by_s = time.monotonic() + END_S
    while not handle.standin_feedback and time.monotonic() < goal_by_s:
        time.sleep(0.005)
    return handle


def finish(node: LsdsNode, handle: ServerGoalHandle) -> Any:
    """Let simulated time pass until a goal has ended; return its result."""
    end_s = time.monotonic() + END_S
    while handle.standin_thread.is_alive() and time.monotonic() < end_s:
        node.on_timer()
    handle.standin_thread.join(END_S)
    return handle.standin_result


def go(node: LsdsNode, position: float) -> Any:
    return finish(node, started(node, position))


def run(node: LsdsNode, count: int) -> None:
    for _ in range(count):
        node.on_timer()


def aperture_m(node: LsdsNode) -> float:
    cell = node.engine.rig.cell
    assert cell is not None
    return cell.truth().aperture_m


def twist(z_m_s: float, *, frame: str = "base", age_s: float | None = 0.0) -> TwistStamped:
    message = TwistStamped()
    message.twist.linear.z = z_m_s
    message.header.frame_id = frame
    if age_s is not None:
        stamp_ns = time.time_ns() - round(age_s * 1e9)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
    return message


def arm_speed_m_s(node: LsdsNode) -> float:
    arm = node.engine.rig.arm
    assert arm is not None
    return math.hypot(*arm.read().tcp_twist.linear_m_s)


# -- what it publishes ----------------------------------------------------------------------------------------


def test_every_frame_is_published_once_with_its_time(node: LsdsNode) -> None:
    images = heard("/lsds/finger/image")
    run(node, 12)
    stamps = [message.header.stamp.sec + message.header.stamp.nanosec * 1e-9 for message in images]
    assert len(set(stamps)) == len(stamps) > 4
    assert abs(time.time() - stamps[-1]) < 0.5
    last = images[-1]
    assert (last.height, last.width, last.encoding, last.step) == (240, 320, "rgb8", 960)
    assert last.header.frame_id == "finger"
    newest = node._running.newest
    assert newest is not None
    sent = np.frombuffer(last.data, np.uint8).reshape(last.height, last.width, 3)
    assert np.array_equal(sent, newest.frame.image)


def test_load_slip_and_aperture_are_published(node: LsdsNode) -> None:
    loads, aperture = heard("/lsds/finger/load"), heard("/lsds/aperture")
    slips, speeds = heard("/lsds/slip_probability"), heard("/lsds/slip_speed")
    run(node, 3)
    assert aperture[-1].data == pytest.approx(STROKE_M, abs=1e-3)
    assert math.isnan(slips[-1].data)
    go(node, GRIP_M)
    run(node, 20)
    for _ in range(80):
        node.on_twist(twist(0.03))
        node.on_timer()
    assert aperture[-1].data == pytest.approx(GRIP_M, abs=2e-3)
    assert max(slip.data for slip in slips if not math.isnan(slip.data)) > 0.5
    assert max(speed.data for speed in speeds if not math.isnan(speed.data)) > 0.005
    wrench = loads[-1].wrench
    assert math.hypot(wrench.force.x, wrench.force.y) > 0.5
    assert wrench.force.z > 1.0
    cell = node.engine.rig.cell
    assert cell is not None
    assert cell.truth().object_height_m > 0.02
    assert not cell.truth().dropped


# -- the gripper ----------------------------------------------------------------------------------------------


def test_a_goal_without_object_is_reached(node: LsdsNode) -> None:
    handle = started(node, 0.04)
    result = finish(node, handle)
    assert handle.status == "succeeded"
    assert (result.reached_goal, result.stalled) == (True, False)
    assert result.position == pytest.approx(0.04, abs=1e-3)


def test_a_goal_on_an_object_stalls_and_is_then_held(node: LsdsNode) -> None:
    handle = started(node, GRIP_M)
    result = finish(node, handle)
    assert handle.status == "succeeded"
    assert (result.reached_goal, result.stalled) == (False, True)
    run(node, 5)
    assert node.engine.stage == "hold"


def test_a_goal_that_still_squeezes_does_not_open_and_a_wide_one_releases(node: LsdsNode) -> None:
    go(node, GRIP_M)
    go(node, GRIP_M - 2e-3)
    squeezed_m = aperture_m(node)
    assert squeezed_m == pytest.approx(GRIP_M - 2e-3, abs=5e-4)
    assert go(node, GRIP_M - 5e-4).stalled
    run(node, 10)
    assert aperture_m(node) < GRIP_M - 1e-3
    assert go(node, 0.045).reached_goal
    assert aperture_m(node) == pytest.approx(0.045, abs=5e-4)


@pytest.mark.parametrize(
    ("position", "max_effort", "words"),
    [
        (math.nan, 0.0, "position nan m is not between 0 and 0.05 m"),
        (0.06, 0.0, "position 0.06 m is not between"),
        (0.02, -1.0, r"max_effort -1.0 N is not a force"),
    ],
)
def test_a_goal_that_cannot_be_is_refused(node: LsdsNode, position: float, max_effort: float, words: str) -> None:
    assert send(node, position, max_effort) is None
    assert words in node.get_logger().lines[-1]
    run(node, 5)
    assert aperture_m(node) == pytest.approx(STROKE_M, abs=1e-3)


def test_a_cancelled_closing_stops_and_does_not_open(node: LsdsNode) -> None:
    handle = started(node, 0.0)
    run(node, 5)
    before_m = aperture_m(node)
    assert 0.035 < before_m < STROKE_M - 1e-3
    node._server.standin_cancel(handle)
    time.sleep(0.1)
    seen = []
    for _ in range(30):
        node.on_timer()
        seen.append(aperture_m(node))
    finish(node, handle)
    assert handle.status == "canceled"
    assert all(later <= earlier + 1e-5 for earlier, later in itertools.pairwise(seen))
    # Of 50 mm/s, within the latency of the gripper and the time that is allowed for the rest.
    assert before_m - 0.01 < seen[-1] <= before_m


def test_a_cancelled_release_keeps_what_is_left_of_the_grip(node: LsdsNode) -> None:
    go(node, 0.035)
    handle = started(node, STROKE_M)
    run(node, 4)
    node._server.standin_cancel(handle)
    time.sleep(0.1)
    finish(node, handle)
    stopped_m = aperture_m(node)
    run(node, 30)
    assert handle.status == "canceled"
    assert aperture_m(node) <= stopped_m + 5e-4 < STROKE_M - 2e-3


@pytest.mark.parametrize("already", [False, True])
def test_a_cancelled_grip_on_an_object_is_held(node: LsdsNode, already: bool) -> None:
    if already:
        go(node, GRIP_M)
    handle = started(node, GRIP_M - 3e-3)
    run(node, 2)
    while math.isnan(node._job._touch_m):
        node.on_timer()
    node._server.standin_cancel(handle)
    time.sleep(0.1)
    finish(node, handle)
    run(node, 20)
    assert node.engine.stage == "hold"
    assert aperture_m(node) <= GRIP_M


def test_a_new_goal_replaces_the_old_one(node: LsdsNode) -> None:
    first = started(node, 0.03)
    run(node, 2)
    second = started(node, 0.04)
    finish(node, first)
    assert first.status == "aborted"
    assert "goal aborted (replaced)" in node.get_logger().lines[-1]
    assert finish(node, second).reached_goal


def test_an_error_aborts_the_goal_and_keeps_the_grip(node: LsdsNode, monkeypatch: pytest.MonkeyPatch) -> None:
    go(node, GRIP_M)
    gripped_m = aperture_m(node)

    def lost() -> Any:
        raise DeviceFault("gel", "unplugged", remedy="plug it in")

    monkeypatch.setattr(node.engine.rig.sensor, "read", lost)
    handle = started(node, STROKE_M)
    with pytest.raises((DeviceFault, SafetyStop), match="unplugged"):
        run(node, 40)
    handle.standin_thread.join(END_S)
    assert handle.status == "aborted"
    assert "the run has ended and the grip is kept" in "".join(node.get_logger().lines)
    with pytest.raises((DeviceFault, SafetyStop), match="unplugged"):
        node.on_timer()
    assert send(node, STROKE_M) is None
    # The goal to open may have come just before the sensor was lost, and nothing opens after that.
    lost_m = aperture_m(node)
    node.close()
    assert aperture_m(node) == pytest.approx(lost_m, abs=1e-4)
    assert gripped_m <= lost_m + 1e-4


def test_closing_the_node_aborts_a_goal_and_keeps_the_grip() -> None:
    node = LsdsNode(overrides=FAST)
    go(node, GRIP_M)
    gripped_m = aperture_m(node)
    handle = started(node, STROKE_M)
    node.close()
    handle.standin_thread.join(END_S)
    assert handle.status == "aborted"
    assert "the node was closed" in node.get_logger().lines[-1]
    assert aperture_m(node) == pytest.approx(gripped_m, abs=1e-4)


# -- the arm --------------------------------------------------------------------------------------------------


def test_a_velocity_moves_the_arm_and_a_stale_one_stops_it(node: LsdsNode) -> None:
    run(node, 3)
    assert arm_speed_m_s(node) == 0.0
    for _ in range(15):
        node.on_twist(twist(0.03))
        node.on_timer()
    assert arm_speed_m_s(node) == pytest.approx(0.03, abs=1e-3)
    clock = node.engine.rig.clock
    began_ns = clock.now()
    while arm_speed_m_s(node) > 0.029:
        node.on_timer()
    assert 0.1 < (clock.now() - began_ns) * 1e-9 < 0.3
    run(node, 10)
    assert arm_speed_m_s(node) == 0.0


def test_the_age_of_a_velocity_counts(node: LsdsNode) -> None:
    for _ in range(15):
        node.on_twist(twist(0.03))
        node.on_timer()
    clock = node.engine.rig.clock
    began_ns = clock.now()
    node.on_twist(twist(0.03, age_s=0.17))
    while arm_speed_m_s(node) > 0.029:
        node.on_timer()
    assert (clock.now() - began_ns) * 1e-9 < 0.15


def test_a_velocity_without_a_stamp_counts_from_its_arrival(node: LsdsNode) -> None:
    for _ in range(15):
        node.on_twist(twist(0.03, age_s=None))
        node.on_timer()
    assert arm_speed_m_s(node) == pytest.approx(0.03, abs=1e-3)


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (lambda: twist(0.03, age_s=0.3), r"it is 0.3\d s old, the limit is 0.2 s"),
        (lambda: twist(0.03, age_s=-5.0), r"it is stamped (5.00|4.99) s ahead"),
        (lambda: twist(0.03, frame="tool0"), "frame 'tool0' is not the base of the arm"),
        (lambda: twist(math.nan), "a number that is not finite"),
    ],
)
def test_a_velocity_that_cannot_be_used_stops_the_arm(node: LsdsNode, message: Any, words: str) -> None:
    for _ in range(15):
        node.on_twist(twist(0.03))
        node.on_timer()
    assert arm_speed_m_s(node) > 0.02
    node.on_twist(message())
    run(node, 6)
    assert arm_speed_m_s(node) == 0.0
    (line,) = node.get_logger().lines
    assert re.search(words, line)
    assert line.endswith("the arm stops")


def test_without_velocities_the_arm_is_left_alone(node: LsdsNode) -> None:
    commands: list[Any] = []
    arm = node.engine.rig.arm
    assert arm is not None
    arm.command = commands.append  # type: ignore[assignment,method-assign]
    run(node, 10)
    assert commands == []


def test_a_rig_without_an_arm_warns_of_velocities() -> None:
    node = LsdsNode(overrides=[*FAST, "arm.backend=none"])
    node.on_twist(twist(0.03))
    run(node, 3)
    node.close()
    assert "the rig has no arm (choose an arm backend)" in node.get_logger().lines[-1]


# -- the program ----------------------------------------------------------------------------------------------


def test_a_rig_without_a_gripper_is_refused() -> None:
    with pytest.raises(ConfigError, match="the node needs a gripper"):
        LsdsNode(overrides=[*FAST, "gripper.backend=none"])


def test_parameters_name_the_rig_and_its_overrides(monkeypatch: pytest.MonkeyPatch) -> None:
    assert parameters() == ("", [])
    monkeypatch.setitem(PARAMETERS, "rig", "rig.toml")
    monkeypatch.setitem(PARAMETERS, "overrides", FAST)
    assert parameters() == ("rig.toml", FAST)


def test_the_program_ends_with_the_error_of_the_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(PARAMETERS, "rig", "missing.toml")
    assert main() == ConfigError.exit_code
    assert "missing.toml" in capsys.readouterr().err
    monkeypatch.setitem(PARAMETERS, "rig", "")
    monkeypatch.setitem(PARAMETERS, "overrides", FAST)
    calls = iter(range(100))

    def timer(node: Node) -> None:
        if next(calls) > 2:
            raise SafetyStop("the watchdog has stopped the cell")

    monkeypatch.setattr(LsdsNode, "on_timer", timer)
    assert main() == SafetyStop.exit_code


def test_in_real_time_the_engine_runs_in_its_own_thread() -> None:
    # The limits are wider than in a cell, because a test machine is busy.
    wide = ["safety.stale_after_s=2.0", "safety.frozen_after_s=2.0", "safety.watchdog_s=5.0"]
    node = LsdsNode(overrides=[*FAST, "clock=wall", "safety.command_lifetime_s=1.0", *wide])
    try:
        handle = started(node, 0.04)
        handle.standin_thread.join(END_S)
        assert handle.standin_result.reached_goal
        node.on_timer()
    finally:
        node.close()
