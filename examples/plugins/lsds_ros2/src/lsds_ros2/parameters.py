"""The parameters of the node, read before the rig is brought up."""

from __future__ import annotations

from rclpy.node import Node


def parameters() -> tuple[str, list[str]]:
    """Return the rig file, "" for the simulated cell, and the overrides "key=value" of its keys."""
    reader = Node("lsds")
    try:
        rig = reader.declare_parameter("rig", "").value
        # A list of one empty string, because ROS cannot infer the type of an empty list.
        overrides = reader.declare_parameter("overrides", [""]).value
    finally:
        reader.destroy_node()
    return str(rig), [str(override) for override in overrides if override]
