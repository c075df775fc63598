"""Contract of a wire mock: a server that speaks a device's own protocol, in its own process."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable


@runtime_checkable
class WireMock(Protocol):
    """The server that `lsds mock NAME` runs. Constructing does no I/O."""

    def start(self) -> Mapping[str, str]:
        """Bind all faces; return the address of each face by name. Raises ConnectFailed if an address is in use."""
        ...

    def serve(self, stop: threading.Event) -> None:
        """Serve clients until `stop` is set. A misbehaving client never ends it."""
        ...

    def inject(self, fault: Mapping[str, Any]) -> None:
        """Start a fault now, from any thread. Raises ConfigError for a fault that this mock does not support."""
        ...

    def close(self) -> None:
        """Release sockets, files and links. A second call does nothing."""
        ...


class ReceivedFrame(NamedTuple):
    """One frame that a client sent to a wire mock: time of its arrival (monotonic ns), face, bytes and meaning."""

    number: int
    t_ns: int
    face: str
    data: bytes
    meaning: str


@runtime_checkable
class ObservedMock(Protocol):
    """A wire mock whose faults can be ended and that reports what it received and what its plant did.

    Optional: `lsds.testing.wire_mock` offers these functions for mocks that have them. All calls come from any thread.
    """

    def end_fault(self, name: str) -> None:
        """End the faults of a name and undo their effects. Raises ConfigError for an unknown name."""
        ...

    def received(self, since: int) -> Sequence[ReceivedFrame]:
        """Return the frames with a number of at least `since`, oldest first. Numbers count from 0 without gaps."""
        ...

    def truths(self, since_ns: int) -> Sequence[Mapping[str, Any]]:
        """Return the states of the plant since a time (monotonic ns), oldest first; the last one is the present.

        The first one is the state at that time, if it is known. Each has `t_ns` and `moving`; all else is in SI units.
        """
        ...
