"""Definitions of the ROS 2 messages of a bag, and their values from the contracts' JSON.

The fields are those of the packages std_msgs, geometry_msgs and sensor_msgs of ROS 2 Humble and later (docs.ros.org).
"""

from __future__ import annotations

import math
from typing import Any

STRING = "std_msgs/msg/String"
IMAGE = "sensor_msgs/msg/CompressedImage"
JOINTS = "sensor_msgs/msg/JointState"
POSE = "geometry_msgs/msg/PoseStamped"
TWIST = "geometry_msgs/msg/TwistStamped"

_TIME = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec")
_HEADER = ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id")
_POINT = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z")
_QUATERNION = ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w")
_VECTOR = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z")
_POSE = ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation")
_TWIST = ("geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular")


def _definition(fields: str, *parts: tuple[str, str]) -> str:
    """Return a definition with those of the types that it uses, as the `ros2msg` encoding of MCAP wants them."""
    rule = "=" * 80
    return "\n".join([fields, *(f"{rule}\nMSG: {name}\n{own}" for name, own in parts)])


DEFINITIONS = {
    STRING: _definition("string data"),
    IMAGE: _definition("std_msgs/Header header\nstring format\nuint8[] data", _HEADER, _TIME),
    JOINTS: _definition(
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort",
        _HEADER,
        _TIME,
    ),
    POSE: _definition("std_msgs/Header header\ngeometry_msgs/Pose pose", _HEADER, _TIME, _POSE, _POINT, _QUATERNION),
    TWIST: _definition("std_msgs/Header header\ngeometry_msgs/Twist twist", _HEADER, _TIME, _TWIST, _VECTOR),
}
"""Definition of each type by its name."""


def header(t_ns: int, frame: str) -> dict[str, Any]:
    """Return a header; `t_ns` since 1970."""
    return {"stamp": {"sec": t_ns // 1_000_000_000, "nanosec": t_ns % 1_000_000_000}, "frame_id": frame}


def pose(value: dict[str, Any]) -> dict[str, Any]:
    """Return a pose of the contracts as geometry_msgs/Pose."""
    turn = dict(zip("xyzw", _numbers(value["quaternion_xyzw"]), strict=True))
    return {"position": _vector(value["position_m"]), "orientation": turn}


def twist(value: dict[str, Any]) -> dict[str, Any]:
    """Return a twist of the contracts as geometry_msgs/Twist."""
    return {"linear": _vector(value["linear_m_s"]), "angular": _vector(value["angular_rad_s"])}


def number(value: float | None) -> float:
    """Return a number; NaN for one that is unknown."""
    return math.nan if value is None else float(value)


def _vector(value: list[float | None]) -> dict[str, float]:
    return dict(zip("xyz", _numbers(value), strict=True))


def _numbers(values: list[float | None]) -> list[float]:
    return [number(each) for each in values]
