"""A Compute Box on a TCP port of this machine, in a thread, so that tests can inject faults."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from lsds.clock import WallClock
from lsds.contracts import BuildContext
from lsds.registry import PluginHost

from lsds_onrobot_rg2.gripper import Rg2Gripper
from lsds_onrobot_rg2.server import Rg2Server


@dataclass
class Box:
    """A mock that serves, and the drivers that were built on it."""

    server: Rg2Server
    port: int
    host: PluginHost
    drivers: list[Rg2Gripper] = field(default_factory=list)

    @property
    def options(self) -> dict[str, Any]:
        """Options of a driver, with time limits for a busy machine."""
        return {"host": "127.0.0.1", "port": self.port, "timeout_s": 0.2, "stale_after_ms": 500.0}

    def driver(self, **options: Any) -> Rg2Gripper:
        """Return a new driver."""
        given = {**self.options, **options}
        self.drivers.append(self.host.build("gripper", "onrobot-rg2", given, BuildContext(WallClock())))
        return self.drivers[-1]

    def armed(self, **options: Any) -> Rg2Gripper:
        """Return a driver that is armed."""
        gripper = self.driver(**options)
        gripper.connect()
        gripper.arm()
        return gripper


@pytest.fixture
def box(request: pytest.FixtureRequest) -> Iterator[Box]:
    """A Compute Box. Parametrize it indirectly with the options of the mock."""
    host = PluginHost()
    server = host.build("wire_mock", "onrobot-rg2", getattr(request, "param", {}), BuildContext(WallClock()))
    port = int(server.start()["tcp"].rpartition(":")[2])
    stop = threading.Event()
    thread = threading.Thread(target=server.serve, args=(stop,), daemon=True)
    thread.start()
    running = Box(server, port, host)
    yield running
    for driver in running.drivers:
        driver.close()
    stop.set()
    thread.join(2.0)
    server.close()
