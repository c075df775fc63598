"""Contract of a mock's wire face: a server that speaks a device's own protocol, run in a process of its own."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable


@runtime_checkable
class WireMock(Protocol):
    """What `lsds mock NAME` runs. Constructing does no I/O."""

    def start(self) -> Mapping[str, str]:
        """Bind everything; return the address of each face by its name. Raises ConnectFailed where one is taken."""
        ...

    def serve(self, stop: threading.Event) -> None:
        """Answer clients until `stop` is set. A client that misbehaves never ends it."""
        ...

    def inject(self, fault: Mapping[str, Any]) -> None:
        """Begin a fault now, from any thread. Raises ConfigError for one that this mock does not know."""
        ...

    def close(self) -> None:
        """Give everything back: sockets, files, links. Does nothing the second time."""
        ...
