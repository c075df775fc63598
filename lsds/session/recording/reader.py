"""Read a recording, also one that ends in the middle: everything before the damage is usable."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

from lsds.contracts import ArmState, CellTruth, Frame, GripperState
from lsds.contracts.events import (
    ArmRead,
    Corrected,
    Event,
    FramesRead,
    GripperRead,
    JobStepped,
    PosesRead,
    TruthKnown,
)
from lsds.errors import DataError
from lsds.session.recording.codec import from_json
from lsds.session.recording.header import NAME, SUMMARY, RecordingHeader
from lsds.session.recording.messages import (
    ARM,
    CORRECTION,
    FRAMES,
    GRIPPER,
    IMAGE,
    JOB,
    POSES,
    TRUTH,
    Poll,
)
from lsds.support.extras import require

if TYPE_CHECKING:
    from numpy.typing import NDArray

IMAGES_KEPT = 64
"""Images of one finger that wait for the poll that they belong to: a damaged recording may have lost it."""


class Raw(NamedTuple):
    """One message as stored. `data` is JSON text or protobuf, by `encoding`."""

    topic: str
    schema: str
    encoding: str
    data: bytes
    now_ns: int
    t_ns: int

    @property
    def value(self) -> Any:
        """The content of a JSON message. Raises ValueError."""
        return json.loads(self.data)


class Recording:
    """A recording on disk.

    `damage` says what is wrong with the file's end after it was read to there; empty if it is whole. `schemas` holds
    the text of each schema read so far by its name. `summary` holds the figures of the run once the file was read to
    its end; None if the run did not write them.
    """

    def __init__(self, path: str | Path) -> None:
        """Read the header. Raises DataError for a file that is no recording of lsds."""
        require("mcap", extra="record", purpose="a recording")
        self.path = Path(path)
        self.damage = ""
        self.schemas: dict[str, bytes] = {}
        self.summary: dict[str, Any] | None = None
        self.header = self._header()

    def messages(self) -> Iterator[Raw]:
        """Yield all messages in the order in which they were written, up to the end or to the first damage."""
        channels: dict[int, Any] = {}
        schemas: dict[int, Any] = {}
        for record in self._records():
            kind = type(record).__name__
            if kind == "Schema":
                schemas[record.id] = record
                self.schemas[record.name] = record.data
            elif kind == "Channel":
                channels[record.id] = record
            elif kind == "Metadata" and record.name == SUMMARY:
                self.summary = _summary(record.metadata)
            elif kind == "Message" and record.channel_id in channels:
                channel = channels[record.channel_id]
                schema = schemas.get(channel.schema_id)
                name = "" if schema is None else schema.name
                yield Raw(
                    channel.topic,
                    name,
                    channel.message_encoding,
                    record.data,
                    record.log_time,
                    record.publish_time,
                )

    def steps(self) -> Iterator[tuple[Event | None, Raw | None]]:
        """Yield in order each input event (event, None), and each recorded output (None, message).

        Raises DataError for a message that is not what its topic promises.
        """
        images: dict[str, dict[int, bytes]] = {}
        for number, message in enumerate(self.messages()):
            where = f"{self.path}: message {number} of {message.topic}"
            if message.topic in _EVENTS:
                yield self._event(message, images, where), None
            elif message.schema == "foxglove.CompressedImage":
                kept = images.setdefault(message.topic, {})
                kept[message.t_ns] = message.data
                while len(kept) > IMAGES_KEPT:
                    del kept[next(iter(kept))]
            elif message.encoding == "json":
                yield None, message

    def events(self) -> Iterator[Event]:
        """Yield the input events in order."""
        for event, _ in self.steps():
            if event is not None:
                yield event

    def frames(self, finger: str | None = None) -> Iterator[tuple[int, Frame]]:
        """Yield (arrival in ns, frame) of a finger, of the first by default. Raises DataError for an unknown one."""
        names = [own.name for own in self.header.fingers]
        name = names[0] if finger is None else finger
        if name not in names:
            raise DataError(f"{self.path}: no finger '{name}' (there are {', '.join(names)})")
        for event in self.events():
            if isinstance(event, FramesRead):
                for own, frame in event.frames:
                    if own == name:
                        yield event.now_ns, frame

    def _event(self, message: Raw, images: dict[str, dict[int, bytes]], where: str) -> Event:
        try:
            value = message.value
        except ValueError as error:
            raise DataError(f"{where}: not JSON: {error}") from error
        if message.topic == FRAMES:
            poll: Poll = from_json(Poll, value, where)
            frames = []
            for read in poll.frames:
                data = images.get(IMAGE.format(read.finger), {}).pop(read.t_ns, None)
                if data is None:
                    raise DataError(f"{where}: frame {read.seq} of finger {read.finger} has no image")
                image = _decoded(data, f"{self.path}: frame {read.seq} of finger {read.finger}")
                frames.append((read.finger, Frame(image, read.t_ns, read.seq, read.redrawn)))
            return FramesRead(poll.now_ns, tuple(frames), poll.depends)
        if message.topic in _STATES:
            kind, event = _STATES[message.topic]
            state: Event = event(message.now_ns, from_json(kind, value, where))
            return state
        whole: Event = from_json(_WHOLE[message.topic], value, where)
        return whole

    def _header(self) -> RecordingHeader:
        for record in self._records():
            if type(record).__name__ == "Metadata" and record.name == NAME:
                return RecordingHeader.from_metadata(record.metadata, str(self.path))
            if type(record).__name__ in ("Message", "Footer"):
                break
        reason = self.damage or "it has no header of lsds"
        raise DataError(f"{self.path}: not a recording of lsds: {reason} (lsds run --record makes one)")

    def _records(self) -> Iterator[Any]:
        from mcap.exceptions import McapError
        from mcap.stream_reader import CRCValidationError, StreamReader

        damaged = (McapError, CRCValidationError, EOFError, struct.error, ValueError, MemoryError)
        try:
            with self.path.open("rb") as file:
                records = iter(StreamReader(file, validate_crcs=True, record_size_limit=MOST_BYTES).records)
                while True:
                    try:
                        record = next(records)
                    except StopIteration:
                        return
                    except Exception as error:
                        if not isinstance(error, damaged) and type(error).__module__.partition(".")[0] != "zstandard":
                            raise
                        at = file.tell()
                        self.damage = f"damaged or cut off near byte {at}: {type(error).__name__} {error}".rstrip()
                        return
                    yield record
        except OSError as error:
            raise DataError(f"{self.path}: cannot be read: {error.strerror or error}") from error


MOST_BYTES = 2**28
"""Greatest size of a record in bytes: more is damage, and must not take the memory."""
_STATES: dict[str, tuple[Any, Any]] = {
    GRIPPER: (GripperState, GripperRead),
    ARM: (ArmState, ArmRead),
    TRUTH: (CellTruth, TruthKnown),
}
_WHOLE: dict[str, Any] = {POSES: PosesRead, JOB: JobStepped, CORRECTION: Corrected}
_EVENTS = frozenset((FRAMES, *_STATES, *_WHOLE))


def _summary(metadata: dict[str, str]) -> dict[str, Any] | None:
    """Return the figures in a metadata record; None if they cannot be read, as the messages do not depend on them."""
    try:
        found = json.loads(metadata["json"])
    except (KeyError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def _decoded(data: bytes, where: str) -> NDArray[np.uint8]:
    """Return the image (height, width, 3), RGB, in a message. Raises DataError."""
    from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
    from google.protobuf.message import DecodeError  # type: ignore[import-untyped]

    try:
        stored = CompressedImage.FromString(data).data
    except DecodeError as error:
        raise DataError(f"{where}: the message is damaged: {error}") from error
    image = cv2.imdecode(np.frombuffer(stored, np.uint8), cv2.IMREAD_COLOR) if stored else None
    if image is None:
        raise DataError(f"{where}: the image is damaged")
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)
