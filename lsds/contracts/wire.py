"""Contract of a wire mock: a server that speaks a device's own protocol, in its own process."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable


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
