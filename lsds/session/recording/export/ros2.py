"""A recording as a ROS 2 bag: a folder with an MCAP file of CDR messages and `metadata.yaml`.

Times are those of the recording, since 1970: `log_time` is when the engine knew a message, `publish_time` and the
stamp of its header when its content was true.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.clock import nanoseconds
from lsds.errors import DataError
from lsds.session.recording.export.bag_metadata import BagFile, Topic, bag_metadata
from lsds.session.recording.export.content import count
from lsds.session.recording.export.ros_messages import RosMessage, ros_messages
from lsds.session.recording.export.ros_types import DEFINITIONS
from lsds.session.recording.export.target import new_folder
from lsds.session.recording.reader import Recording
from lsds.support.extras import require

if TYPE_CHECKING:
    from lsds.session.recording.reader import Raw


def to_ros2(path: Path, out: Path, progress: Callable[[int, int], None] | None = None) -> dict[str, int]:
    """Write a recording as a new bag; return the messages by topic. Raises MissingExtra, DataError."""
    require("mcap_ros2", extra="ros2", purpose="an export to ROS 2")
    recording = Recording(path)
    since_ns = nanoseconds(recording.header.started_utc_s) - recording.header.started_ns
    whole = count(recording)
    if not whole:
        raise DataError(f"{path}: no message to export")
    with new_folder(out) as target:
        name = f"{target.path.resolve().name}_0.mcap"
        with (out / name).open("xb") as file:
            bag = _Bag(file)
            for number, raw in enumerate(recording.messages(), 1):
                for message in ros_messages(raw, since_ns, path):
                    bag.add(message, raw, since_ns)
                if progress is not None:
                    progress(number, whole)
            bag.finish()
        stated = BagFile(name, bag.first_ns, bag.last_ns, tuple(bag.topics.values()))
        (out / "metadata.yaml").write_text(bag_metadata(stated), encoding="utf-8")
    return {topic.name: topic.messages for topic in sorted(bag.topics.values())}


class _Bag:
    """The MCAP file of a bag. `topics` by name; `first_ns` and `last_ns` are the log times at its ends."""

    def __init__(self, file: Any) -> None:
        from mcap_ros2.writer import Writer

        self.topics: dict[str, Topic] = {}
        self.first_ns = self.last_ns = 0
        self._writer: Any = Writer(file)
        self._schemas: dict[str, Any] = {}
        self._sources: dict[str, str] = {}

    def add(self, message: RosMessage, raw: Raw, since_ns: int) -> None:
        """Write a message with the times of ours. Raises DataError if two topics of ours have one name in ROS."""
        schema = self._schemas.get(message.kind)
        if schema is None:
            schema = self._schemas[message.kind] = self._writer.register_msgdef(message.kind, DEFINITIONS[message.kind])
        topic = self.topics.get(message.topic, Topic(message.topic, message.kind, 0))
        other = self._sources.setdefault(message.topic, raw.topic)
        if other != raw.topic:
            raise DataError(
                f"{raw.topic}: its name in ROS is {message.topic}, and that of {other} too (give the fingers names "
                "that differ in letters or digits, and record again)"
            )
        now_ns = since_ns + raw.now_ns
        self._writer.write_message(
            message.topic, schema, message.value, now_ns, since_ns + raw.t_ns, sequence=topic.messages
        )
        self.topics[message.topic] = topic._replace(messages=topic.messages + 1)
        self.first_ns = min(self.first_ns or now_ns, now_ns)
        self.last_ns = max(self.last_ns, now_ns)

    def finish(self) -> None:
        """Write the end of the file."""
        self._writer.finish()
