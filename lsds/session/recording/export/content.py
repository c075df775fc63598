"""The content of any message of a recording as plain values."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.errors import DataError

if TYPE_CHECKING:
    from lsds.session.recording.reader import Raw, Recording

VIEWER_TYPES = ("CompressedImage", "JointStates", "Log", "PoseInFrame")
"""Protobuf types that a recording holds, without their package `foxglove`."""


def content(raw: Raw, path: Path) -> Any:
    """Return JSON as parsed, and protobuf as a dictionary with times in ns. Raises DataError."""
    try:
        if raw.encoding == "json":
            return raw.value
        return _plain(parsed(raw))
    except ValueError as error:
        raise DataError(
            f"{path}: a message of {raw.topic} at {raw.now_ns} ns is damaged: {error} (lsds record cut leaves it out)"
        ) from error


def parsed(raw: Raw) -> Any:
    """Return the protobuf message in a message of a well-known type. Raises ValueError."""
    from google.protobuf.message import DecodeError  # type: ignore[import-untyped]

    name = raw.schema.removeprefix("foxglove.")
    if raw.encoding != "protobuf" or name not in VIEWER_TYPES:
        raise ValueError(f"unknown type {raw.schema} in {raw.encoding}")
    kind = getattr(importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name)
    try:
        return kind.FromString(raw.data)
    except DecodeError as error:
        raise ValueError(str(error)) from error


def count(recording: Recording) -> int:
    """Return the number of messages that can be read, for the progress of longer work."""
    return sum(1 for _ in recording.messages())


def _plain(message: Any) -> Any:
    if message.DESCRIPTOR.full_name == "google.protobuf.Timestamp":
        return message.seconds * 1_000_000_000 + message.nanos
    found = {}
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        name = "t_ns" if field.name == "timestamp" else field.name
        if field.is_repeated:
            found[name] = [_plain(each) if field.message_type else each for each in value]
        else:
            found[name] = _plain(value) if field.message_type else value
    return found
