"""The `metadata.yaml` of a ROS 2 bag, in version 5 of its format, which rosbag2 reads since Humble.

The fields are those of rosbag2_storage/include/rosbag2_storage/yaml.hpp in github.com/ros2/rosbag2.
"""

from __future__ import annotations

import json
from typing import NamedTuple

METADATA_VERSION = 5
"""Version of the format: later ones add fields that readers of this one do not need."""


class Topic(NamedTuple):
    """A topic of a bag: name, type, number of messages."""

    name: str
    kind: str
    messages: int


class BagFile(NamedTuple):
    """The file of a bag; times in ns since 1970."""

    name: str
    first_ns: int
    last_ns: int
    topics: tuple[Topic, ...]


def bag_metadata(file: BagFile) -> str:
    """Return the metadata of a bag of one file as YAML."""
    duration_ns, messages = file.last_ns - file.first_ns, sum(topic.messages for topic in file.topics)
    lines = [
        f"version: {METADATA_VERSION}",
        "storage_identifier: mcap",
        "duration:",
        f"  nanoseconds: {duration_ns}",
        "starting_time:",
        f"  nanoseconds_since_epoch: {file.first_ns}",
        f"message_count: {messages}",
        "topics_with_message_count:",
    ]
    for topic in sorted(file.topics):
        lines += [
            "  - topic_metadata:",
            f"      name: {topic.name}",
            f"      type: {topic.kind}",
            "      serialization_format: cdr",
            '      offered_qos_profiles: ""',
            f"    message_count: {topic.messages}",
        ]
    # Text in the form of JSON is YAML, whatever characters it holds.
    name = json.dumps(file.name)
    lines += [
        'compression_format: ""',
        'compression_mode: ""',
        "relative_file_paths:",
        f"  - {name}",
        "files:",
        f"  - path: {name}",
        "    starting_time:",
        f"      nanoseconds_since_epoch: {file.first_ns}",
        "    duration:",
        f"      nanoseconds: {duration_ns}",
        f"    message_count: {messages}",
    ]
    return "\n".join(["rosbag2_bagfile_information:", *(f"  {line}" for line in lines), ""])
