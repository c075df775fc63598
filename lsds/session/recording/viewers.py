"""Messages of well-known types in addition to ours: Foxglove and Rerun show gripper, arm and poses without a plugin."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from lsds.session.recording.messages import ARM, GRIPPER, POSES

if TYPE_CHECKING:
    from lsds.contracts import Pose
    from lsds.session.recording.messages import Message


def viewer_messages(message: Message) -> Iterator[tuple[str, Any]]:
    """Yield (topic, protobuf message) for a message of ours that viewers cannot draw."""
    if message.topic == GRIPPER:
        yield "/gripper/joints", _joints(message)
    elif message.topic == ARM:
        yield "/arm/tcp", _pose(message.value.tcp_pose, message.t_ns, "base")
    elif message.topic == POSES and message.value.sample is not None:
        for body, pose in message.value.sample.poses.items():
            yield f"/pose/{body}", _pose(pose, message.t_ns, "camera")


def _joints(message: Message) -> Any:
    from foxglove_schemas_protobuf.JointState_pb2 import JointState
    from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

    return JointStates(
        timestamp=stamp(message.t_ns), joints=[JointState(name="aperture", position=message.value.aperture_m)]
    )


def _pose(pose: Pose, t_ns: int, frame: str) -> Any:
    from foxglove_schemas_protobuf.Pose_pb2 import Pose as PoseMessage
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
    from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
    from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

    position, turn = pose.position_m, pose.quaternion_xyzw
    return PoseInFrame(
        timestamp=stamp(t_ns),
        frame_id=frame,
        pose=PoseMessage(
            position=Vector3(x=position[0], y=position[1], z=position[2]),
            orientation=Quaternion(x=turn[0], y=turn[1], z=turn[2], w=turn[3]),
        ),
    )


def stamp(t_ns: int) -> Any:
    """Return a time (ns) as a protobuf time stamp."""
    from google.protobuf.timestamp_pb2 import Timestamp  # type: ignore[import-untyped]

    return Timestamp(seconds=t_ns // 1_000_000_000, nanos=t_ns % 1_000_000_000)
