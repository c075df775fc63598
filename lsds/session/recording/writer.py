"""Write a recording while a run goes on. Whatever ends the run, its recording can be read."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import cv2

from lsds.clock import nanoseconds, perf_ns
from lsds.errors import DataError
from lsds.session.recording.chunk_indexes import keep_as_bytes
from lsds.session.recording.codec import to_json, to_text
from lsds.session.recording.header import NAME, SUMMARY, RecordingHeader
from lsds.session.recording.messages import SCHEMAS, Image, Message, messages_of
from lsds.session.recording.viewers import stamp, viewer_messages
from lsds.support.extras import require

if TYPE_CHECKING:
    from lsds.contracts.events import Published
    from lsds.session.recording.reader import Raw

Images = Literal["lossless", "jpeg"]
"""How images are stored: "lossless" (PNG), from which a replay is exact, or "jpeg", a tenth of the size."""

CHUNK_BYTES = 1024 * 1024
"""Size at which a chunk of messages is compressed and written: each chunk has an entry of some 300 bytes in the file's
index, which stays in memory until the end."""
FLUSH_S = 0.25
"""Time after which a chunk is written whatever its size: a process that is killed loses no more than that."""
LEAST_FREE_BYTES = 100_000_000
"""Least free space on the disk at the start: that of some seconds of two lossless fingers."""
PNG = (
    *(cv2.IMWRITE_PNG_COMPRESSION, 1),
    *(cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY),
    # Older versions of OpenCV choose the filter themselves.
    *((cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_UP) if hasattr(cv2, "IMWRITE_PNG_FILTER") else ()),
)
"""Parameters of PNG: differences of rows without a search for repetitions, which a camera's noise does not have; half
the time of OpenCV's defaults for a tactile image, and fewer bytes."""
RECORDED_JPEG_QUALITY = 90
"""Quality of JPEG images, 0 to 100."""


class RecordingWriter:
    """An observer of `Engine.events` that writes an MCAP file. It never overwrites a file.

    `written` is the number of messages so far. `summary` holds the figures of the run; `close` writes them if they are
    set by then. `observe` raises DataError where the disk fails; the file is then cut
    back to its last whole chunk, which stays readable.
    """

    def __init__(self, path: Path, header: RecordingHeader, images: Images = "lossless") -> None:
        """Create the file. Raises DataError: it exists, its folder is missing, or the disk is full."""
        require("mcap", "foxglove_schemas_protobuf", "orjson", extra="record", purpose="a recording")
        from mcap.writer import Writer

        self.path, self.written = path, 0
        self.summary: dict[str, Any] | None = None
        self._images = images
        self._file = _created(path)
        self._whole_bytes = 0
        self._channels: dict[str, int] = {}
        self._sequence: dict[str, int] = {}
        self._broken = False
        self._writer: Any = Writer(self._file, chunk_size=CHUNK_BYTES)
        keep_as_bytes(self._writer)
        with self._on_disk():
            self._writer.start(profile="", library=f"lsds {header.lsds}")
            self._writer.add_metadata(NAME, header.as_metadata())
            self._flush()

    def observe(self, event: Published) -> None:
        """Write an event. Raises DataError."""
        if self._broken:
            return
        with self._on_disk():
            for message in messages_of(event):
                if isinstance(message, Image):
                    self._add_image(message)
                else:
                    self._add_json(message)
                    for topic, value in viewer_messages(message):
                        self._add(topic, value, message.now_ns, message.t_ns)
            if perf_ns() - self._flushed_ns > nanoseconds(FLUSH_S):
                self._flush()

    def copy(self, message: Raw, schema: bytes) -> None:
        """Write a message of another recording as it is; `schema` is the text of its schema. Raises DataError."""
        channel = self._channels.get(message.topic)
        with self._on_disk():
            if channel is None:
                encoding = "protobuf" if message.encoding == "protobuf" else "jsonschema"
                identifier = self._writer.register_schema(message.schema, encoding, schema)
                channel = self._writer.register_channel(message.topic, message.encoding, identifier)
                self._channels[message.topic] = channel
            self._put(channel, message.topic, message.data, message.now_ns, message.t_ns)

    def close(self) -> None:
        """Finish the file; do nothing the second time. Raises DataError."""
        if self._broken or self._file.closed:
            return
        problem: TypeError | None = None
        with self._on_disk():
            if self.summary is not None:
                try:
                    self._writer.add_metadata(SUMMARY, {"json": json.dumps(to_json(self.summary))})
                except TypeError as error:
                    problem = error
            self._writer.finish()
            self._file.close()
        if problem is not None:
            raise DataError(f"{self.path}: the recording has no summary: {problem} (a value of a plugin)") from problem

    def discard(self) -> None:
        """Remove the file: the run did not begin."""
        self._broken = True
        try:
            self._file.close()
        finally:
            self.path.unlink(missing_ok=True)

    def _add_image(self, image: Image) -> None:
        from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

        frame = image.frame
        bgr = cv2.cvtColor(frame.image, cv2.COLOR_RGB2BGR)
        if self._images == "jpeg":
            _, data = cv2.imencode(".jpg", bgr, (cv2.IMWRITE_JPEG_QUALITY, RECORDED_JPEG_QUALITY))
        else:
            _, data = cv2.imencode(".png", bgr, PNG)
        kind = "jpeg" if self._images == "jpeg" else "png"
        value = CompressedImage(timestamp=stamp(frame.t_ns), frame_id=image.finger, data=data.tobytes(), format=kind)
        self._add(image.topic, value, image.now_ns, frame.t_ns)

    def _add_json(self, message: Message) -> None:
        channel = self._channels.get(message.topic)
        if channel is None:
            name = message.topic.rsplit("/", 1)[-1]
            schema = SCHEMAS.get(message.topic, SCHEMAS.get(name, {"type": "object"}))
            title = schema.get("title", name.capitalize())
            identifier = self._writer.register_schema(f"lsds.{title}", "jsonschema", json.dumps(schema).encode())
            channel = self._channels[message.topic] = self._writer.register_channel(message.topic, "json", identifier)
        self._put(channel, message.topic, to_text(message.value), message.now_ns, message.t_ns)

    def _add(self, topic: str, value: Any, now_ns: int, t_ns: int) -> None:
        """Write a message of a well-known type."""
        from mcap_protobuf.schema import build_file_descriptor_set

        channel = self._channels.get(topic)
        if channel is None:
            kind = type(value)
            described = build_file_descriptor_set(kind).SerializeToString()
            identifier = self._writer.register_schema(kind.DESCRIPTOR.full_name, "protobuf", described)
            channel = self._channels[topic] = self._writer.register_channel(topic, "protobuf", identifier)
        self._put(channel, topic, value.SerializeToString(), now_ns, t_ns)

    def _put(self, channel: int, topic: str, data: bytes, now_ns: int, t_ns: int) -> None:
        number = self._sequence[topic] = self._sequence.get(topic, -1) + 1
        self._writer.add_message(channel, log_time=now_ns, publish_time=t_ns, sequence=number, data=data)
        self.written += 1

    @contextmanager
    def _on_disk(self) -> Iterator[None]:
        """Give the file up where the disk fails in the body. Raises DataError then."""
        try:
            yield
        except OSError as error:
            self._give_up()
            raise _failed(self.path, error) from error

    def _flush(self) -> None:
        self._writer.flush()
        self._flushed_ns = perf_ns()
        self._whole_bytes = self._file.tell()

    def _give_up(self) -> None:
        """Leave the file as it was after its last flush: a part of a chunk would make readers complain."""
        self._broken = True
        try:
            # Closing would try to write what the buffer still holds.
            self._file.raw.truncate(self._whole_bytes)
            self._file.raw.close()
        except OSError:
            return


def _created(path: Path) -> Any:
    """Create a file for writing. Raises DataError."""
    try:
        free = shutil.disk_usage(path.parent).free
    except OSError as error:
        raise DataError(f"{path}: the recording cannot be written: no folder {path.parent} (create it)") from error
    if free < LEAST_FREE_BYTES:
        raise DataError(f"{path}: only {free / 1e6:.0f} MB are free, a recording needs {LEAST_FREE_BYTES / 1e6:.0f} MB")
    try:
        return path.open("xb")
    except FileExistsError as error:
        raise DataError(
            f"{path}: exists already, and a recording overwrites nothing (choose another name, or remove it)"
        ) from error
    except OSError as error:
        raise _failed(path, error) from error


def _failed(path: Path, error: OSError) -> DataError:
    return DataError(
        f"{path}: the recording cannot be written: {error.strerror or error} (free some space; what was recorded until "
        "then can be read)"
    )
