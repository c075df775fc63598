"""The node in an installed ROS 2: the same calls and messages as in the stand-in."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
import time
import rclpy
from control_msgs.action import GripperCommand
from lsds_ros2.node import LsdsNode
from rclpy.action import ActionClient
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image

rclpy.init()
node, other, images = LsdsNode(overrides=["cell.simulated.fidelity=winkler"]), Node("other"), []
other.create_subscription(Image, "/lsds/finger/image", images.append, qos_profile_sensor_data)
client = ActionClient(other, GripperCommand, "/lsds/gripper_command")
executor = MultiThreadedExecutor()
executor.add_node(node)
executor.add_node(other)
assert client.wait_for_server(timeout_sec=10.0)
goal = GripperCommand.Goal()
goal.command.position = 0.04
sent = client.send_goal_async(goal)
executor.spin_until_future_complete(sent, timeout_sec=10.0)
result = sent.result().get_result_async()
executor.spin_until_future_complete(result, timeout_sec=20.0)
assert result.result().result.reached_goal
assert images and len(images[-1].data) == 240 * 320 * 3
node.close()
other.destroy_node()
rclpy.try_shutdown()
print("found")
"""


def _run(program: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a program in a process that does not have the stand-in on its path."""
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=cwd)


def test_without_ros_the_job_can_be_imported(tmp_path: Path) -> None:
    done = _run("import lsds_ros2.serve, sys; print('rclpy' in sys.modules)", tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "False\n"


@pytest.mark.slow
def test_the_installed_ros_runs_it(tmp_path: Path) -> None:
    if _run("import rclpy, control_msgs.action", tmp_path).returncode:
        pytest.skip("ROS 2 with control_msgs is not installed, or its setup file was not sourced")
    done = _run(PROGRAM, tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("found\n")
