"""The program `lsds-ros2`: the node until it is interrupted, or until the run ends with an error."""

from __future__ import annotations

import sys

import lsds

import rclpy
from lsds_ros2.node import LsdsNode
from lsds_ros2.parameters import parameters
from rclpy.executors import MultiThreadedExecutor


def main() -> int:
    """Run the node with its parameters `rig` and `overrides`; return the exit code."""
    rclpy.init()
    try:
        node = LsdsNode(*parameters())
    except lsds.LsdsError as error:
        print(f"lsds-ros2: {error}", file=sys.stderr)
        rclpy.try_shutdown()
        return error.exit_code
    executor = MultiThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    except lsds.LsdsError as error:
        # The node has logged it.
        return error.exit_code
    except KeyboardInterrupt:
        return 130
    finally:
        node.close()
        executor.shutdown()
        rclpy.try_shutdown()
    return 0
