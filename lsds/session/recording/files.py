"""Work on whole recordings: state their contents, cut and repair them."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.errors import DataError
from lsds.session.recording.reader import Recording
from lsds.session.recording.writer import RecordingWriter

if TYPE_CHECKING:
    from collections.abc import Callable

    from lsds.session.recording.reader import Raw


def contents(path: Path) -> dict[str, Any]:
    """Return what a recording holds: messages, rate (Hz), size and type by topic, begin and length (s), and its damage.

    Raises DataError for a file that is no recording.
    """
    recording = Recording(path)
    header = recording.header
    topics: dict[str, dict[str, Any]] = {}
    first_ns = last_ns = -1
    spans: dict[str, tuple[int, int]] = {}
    for message in recording.messages():
        own = topics.setdefault(message.topic, {"messages": 0, "bytes": 0, "schema": message.schema})
        own["messages"] += 1
        own["bytes"] += len(message.data)
        spans[message.topic] = spans.get(message.topic, (message.now_ns, 0))[0], message.now_ns
        first_ns = message.now_ns if first_ns < 0 else min(first_ns, message.now_ns)
        last_ns = max(last_ns, message.now_ns)
    for name, own in topics.items():
        first, last = spans[name]
        own["rate_hz"] = (own["messages"] - 1) / ((last - first) * 1e-9) if last > first else 0.0
    return {
        "file": str(path),
        "lsds": header.lsds,
        "started": datetime.fromtimestamp(header.started_utc_s, UTC).isoformat(timespec="seconds"),
        "simulated": header.simulated,
        "fingers": [finger.name for finger in header.fingers],
        "begins_s": 0.0 if first_ns < 0 else (first_ns - header.started_ns) * 1e-9,
        "duration_s": (last_ns - first_ns) * 1e-9,
        "bytes": path.stat().st_size,
        "damage": recording.damage,
        "topics": dict(sorted(topics.items())),
    }


def cut(path: Path, out: Path, start_s: float = 0.0, end_s: float | None = None) -> int:
    """Copy the messages between two times (s since the start) to a new file; return their number.

    Raises DataError: no recording, no message in between, or the new file cannot be written.
    """
    begin_ns = Recording(path).header.started_ns
    end = math.inf if end_s is None else end_s
    if not start_s < end:
        raise DataError(f"{path}: a part from {start_s:g} s to {end:g} s is empty (--from before --to)")
    written, _ = _copied(path, out, lambda message: start_s <= (message.now_ns - begin_ns) * 1e-9 <= end, whole=False)
    return written


def repair(path: Path, out: Path) -> tuple[int, str]:
    """Copy everything that can be read to a new file; return the number of messages and the damage, "" for none.

    Raises DataError.
    """
    return _copied(path, out, lambda message: True, whole=True)


def _copied(path: Path, out: Path, wanted: Callable[[Raw], bool], *, whole: bool) -> tuple[int, str]:
    recording = Recording(path)
    if out.exists() and out.samefile(path):
        raise DataError(f"{out}: is the recording itself (choose another name for the copy)")
    copier = RecordingWriter(out, recording.header)
    try:
        for message in recording.messages():
            if wanted(message):
                copier.copy(message, recording.schemas.get(message.schema, b""))
        if not copier.written:
            raise DataError(f"{path}: no message to copy")
        # The summary of the run is not that of a part.
        copier.summary = recording.summary if whole else None
        copier.close()
    except BaseException:
        copier.discard()
        raise
    return copier.written, recording.damage
