"""A ROS 2 bag: the decoder of another project reads it, and its values are those of the recording."""

from __future__ import annotations

import json
import struct
from collections import Counter

import cv2
import numpy as np
import pytest

from lsds.clock import nanoseconds
from lsds.errors import DataError
from lsds.session.recording.export import ros2
from lsds.session.recording.export.ros2 import to_ros2
from lsds.session.recording.export.ros_messages import ros_name
from lsds.session.recording.reader import Recording

pytest.importorskip("mcap_ros2", reason="bags need the extra ros2")
yaml = pytest.importorskip("yaml")


@pytest.fixture(scope="module")
def bag(recorded, tmp_path_factory):
    out = tmp_path_factory.mktemp("bags") / "bag"
    return out, to_ros2(recorded[0], out)


@pytest.fixture(scope="module")
def messages(bag):
    """(schema, channel, message, decoded message) of all messages."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with (bag[0] / "bag_0.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        return list(reader.iter_decoded_messages())


def of(messages, topic):
    return [(message, value) for _, channel, message, value in messages if channel.topic == topic]


def stamp_ns(value):
    return value.header.stamp.sec * 1_000_000_000 + value.header.stamp.nanosec


def test_the_metadata_is_that_of_the_file(bag, messages):
    found = yaml.safe_load((bag[0] / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert (found["version"], found["storage_identifier"]) == (5, "mcap")
    assert found["relative_file_paths"] == [found["files"][0]["path"]] == ["bag_0.mcap"]
    counts = Counter((channel.topic, schema.name) for schema, channel, _, _ in messages)
    stated = {
        (own["topic_metadata"]["name"], own["topic_metadata"]["type"]): own["message_count"]
        for own in found["topics_with_message_count"]
    }
    assert stated == counts
    assert found["message_count"] == len(messages) == sum(bag[1].values())
    times = [message.log_time for _, _, message, _ in messages]
    assert found["starting_time"]["nanoseconds_since_epoch"] == min(times)
    assert found["duration"]["nanoseconds"] == max(times) - min(times)


def test_every_message_is_cdr_of_a_type_of_ros(messages):
    assert {channel.message_encoding for _, channel, _, _ in messages} == {"cdr"}
    assert {(schema.name, schema.encoding) for schema, _, _, _ in messages} == {
        ("std_msgs/msg/String", "ros2msg"),
        ("sensor_msgs/msg/CompressedImage", "ros2msg"),
        ("sensor_msgs/msg/JointState", "ros2msg"),
        ("geometry_msgs/msg/PoseStamped", "ros2msg"),
        ("geometry_msgs/msg/TwistStamped", "ros2msg"),
    }


def test_times_are_since_1970(recorded, messages):
    header = Recording(recorded[0]).header
    first = next(raw for raw in Recording(recorded[0]).messages() if raw.topic == "/gripper/state")
    message, value = of(messages, "/gripper/joints")[0]
    since_ns = nanoseconds(header.started_utc_s) - header.started_ns
    assert message.log_time == first.now_ns + since_ns
    assert message.publish_time == stamp_ns(value) == first.t_ns + since_ns


def test_images_states_and_twists_are_those_of_the_recording(recorded, messages):
    path, _ = recorded
    frame = next(frame for _, frame in Recording(path).frames())
    _, image = of(messages, "/finger/finger/image/compressed")[0]
    assert (image.format, image.header.frame_id) == ("png", "finger")
    decoded = cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(cv2.cvtColor(decoded, cv2.COLOR_BGR2RGB), frame.image)
    raws = list(Recording(path).messages())
    grippers = [raw.value for raw in raws if raw.topic == "/gripper/state"]
    joints = [value for _, value in of(messages, "/gripper/joints")]
    assert [(list(each.name), list(each.position)) for each in joints] == [
        (["aperture"], [each["aperture_m"]]) for each in grippers
    ]
    arms = [raw.value for raw in raws if raw.topic == "/arm/state"]
    poses = [value.pose for _, value in of(messages, "/arm/tcp")]
    assert [[p.position.x, p.position.y, p.position.z] for p in poses] == [a["tcp_pose"]["position_m"] for a in arms]
    assert {p.orientation.w for p in poses} == {1.0}
    twists = [value.twist.linear.z for _, value in of(messages, "/arm/twist")]
    assert twists == [each["tcp_twist"]["linear_m_s"][2] for each in arms]
    assert max(twists) > 0
    assert of(messages, "/job/twist")


def test_everything_else_is_json_in_a_string(recorded, messages):
    raws = [raw.value for raw in Recording(recorded[0]).messages() if raw.topic == "/grip"]
    assert [json.loads(value.data) for _, value in of(messages, "/grip")] == raws


def test_a_string_is_laid_out_as_cdr_demands(messages):
    """OMG CDR: 4 bytes of encapsulation (little-endian), length with the final zero, text, zero."""
    _, _, message, value = next(each for each in messages if each[1].topic == "/grip")
    assert message.data[:4] == b"\x00\x01\x00\x00"
    assert struct.unpack_from("<I", message.data, 4) == (len(value.data) + 1,)
    assert message.data[8 : 8 + len(value.data) + 1] == value.data.encode() + b"\0"


def test_no_path_is_overwritten_and_a_failed_export_leaves_nothing(recorded, bag, tmp_path, monkeypatch):
    with pytest.raises(DataError, match="exists already"):
        to_ros2(recorded[0], bag[0])
    monkeypatch.setattr(ros2, "bag_metadata", lambda file: (_ for _ in ()).throw(OSError(28, "No space left")))
    with pytest.raises(DataError, match="No space left"):
        to_ros2(recorded[0], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_two_topics_with_one_name_in_ros_are_an_error(recorded, tmp_path, monkeypatch):
    from lsds.session.recording.export import ros_messages

    monkeypatch.setattr(ros_messages, "ros_name", lambda topic: "/same")
    with pytest.raises(DataError, match="its name in ROS is /same"):
        to_ros2(recorded[0], tmp_path / "out")


@pytest.mark.parametrize(
    ("topic", "name"), [("/finger/left-1/load", "/finger/left_1/load"), ("/pose/3d box", "/pose/_3d_box")]
)
def test_names_are_those_that_ros_allows(topic, name):
    assert ros_name(topic) == name
