"""A stand-in for rclpy: the calls that the node uses, in one process, written from its documentation."""

from rclpy.world import init, try_shutdown

__all__ = ["init", "try_shutdown"]
