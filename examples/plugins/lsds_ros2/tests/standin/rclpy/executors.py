"""Executors."""

from __future__ import annotations

import time

from rclpy.node import Node
from rclpy.world import RUNS


class MultiThreadedExecutor:
    """Calls the timers of its nodes; each goal runs in a separate thread."""

    def __init__(self) -> None:
        self._nodes: list[Node] = []

    def add_node(self, node: Node) -> None:
        """Add a node."""
        self._nodes.append(node)

    def spin(self) -> None:
        """Call timers until ROS ends. An exception of a callback ends it, too."""
        while RUNS[0]:
            for node in self._nodes:
                for timer in node.standin_timers:
                    timer.callback()
                    time.sleep(timer.period_s)

    def shutdown(self) -> None:
        """End the executor."""
        self._nodes.clear()
