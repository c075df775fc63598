"""The messages of a ROS 2 bag that stand for a message of a recording."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from lsds.errors import DataError
from lsds.session.recording.export import ros_types
from lsds.session.recording.export.content import content
from lsds.session.recording.messages import ARM, GRIPPER, JOB, POSES

if TYPE_CHECKING:
    from lsds.session.recording.reader import Raw

IMAGE_SCHEMA, LOG_SCHEMA = "foxglove.CompressedImage", "foxglove.Log"


class RosMessage(NamedTuple):
    """One message: topic, type, and the value by field."""

    topic: str
    kind: str
    value: dict[str, Any]


def ros_messages(raw: Raw, since_ns: int, path: Path) -> Iterator[RosMessage]:
    """Yield the ROS messages of one of ours; `since_ns` is the time since 1970 at which the rig's clock was 0.

    Every JSON message becomes a String of its topic; images, states and twists get their own types. The protobuf
    messages for viewers are left out: the same values are in those. Raises DataError for a damaged message.
    """
    if raw.schema == IMAGE_SCHEMA:
        image = content(raw, path)
        header = ros_types.header(since_ns + raw.t_ns, image["frame_id"])
        value = {"header": header, "format": image["format"], "data": image["data"]}
        # Viewers of ROS look for compressed images below the topic of the image.
        yield RosMessage(ros_name(raw.topic) + "/compressed", ros_types.IMAGE, value)
        return
    if raw.schema == LOG_SCHEMA:
        yield RosMessage(ros_name(raw.topic), ros_types.STRING, {"data": json.dumps(content(raw, path))})
        return
    if raw.encoding != "json":
        return
    value = content(raw, path)
    yield RosMessage(ros_name(raw.topic), ros_types.STRING, {"data": raw.data.decode()})
    try:
        yield from _typed(raw, value, since_ns)
    except (KeyError, TypeError, ValueError) as error:
        raise DataError(f"{path}: a message of {raw.topic} at {raw.now_ns} ns has another form: {error!r}") from error


def ros_name(topic: str) -> str:
    """Return a topic as a name of ROS 2: letters, digits and underscores, no part that begins with a digit."""
    parts = [re.sub(r"[^A-Za-z0-9_]", "_", part) for part in topic.strip("/").split("/")]
    return "/" + "/".join(f"_{part}" if part[:1].isdigit() else part for part in parts)


def _typed(raw: Raw, value: Any, since_ns: int) -> Iterator[RosMessage]:
    def header(frame: str) -> dict[str, Any]:
        return ros_types.header(since_ns + raw.t_ns, frame)

    if raw.topic == GRIPPER:
        joints = {"name": ["aperture"], "position": [ros_types.number(value["aperture_m"])]}
        empty: dict[str, Any] = {"velocity": [], "effort": []}
        yield RosMessage("/gripper/joints", ros_types.JOINTS, {"header": header("gripper"), **joints, **empty})
    elif raw.topic == ARM:
        pose, twist = ros_types.pose(value["tcp_pose"]), ros_types.twist(value["tcp_twist"])
        yield RosMessage("/arm/tcp", ros_types.POSE, {"header": header("base"), "pose": pose})
        yield RosMessage("/arm/twist", ros_types.TWIST, {"header": header("base"), "twist": twist})
    elif raw.topic == POSES and value["sample"] is not None:
        for body, each in value["sample"]["poses"].items():
            pose = ros_types.pose(each)
            yield RosMessage(ros_name(f"/pose/{body}"), ros_types.POSE, {"header": header("camera"), "pose": pose})
    elif raw.topic == JOB and value["wanted"]["twist"] is not None:
        twist = ros_types.twist(value["wanted"]["twist"])
        yield RosMessage("/job/twist", ros_types.TWIST, {"header": header("base"), "twist": twist})
