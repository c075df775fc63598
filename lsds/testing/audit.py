"""Records what Python's audit events show while code runs. An audit hook cannot be removed, so there is one for all."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

Describe = Callable[[str, tuple[Any, ...]], str]
"""Returns the text to record of an event and its arguments, "" for an event that does not count."""

_recording: list[tuple[Describe, list[str]]] = []
_installed: list[bool] = []


@contextmanager
def audited(describe: Describe) -> Iterator[list[str]]:
    """Yield the list of events that count, which grows while the body runs. An inner recording pauses an outer one."""
    if not _installed:
        sys.addaudithook(_audit)
        _installed.append(True)
    recording = describe, list[str]()
    _recording.append(recording)
    try:
        yield recording[1]
    finally:
        _recording.remove(recording)


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if not _recording:
        return
    describe, calls = _recording[-1]
    if text := describe(event, arguments):
        calls.append(text)
