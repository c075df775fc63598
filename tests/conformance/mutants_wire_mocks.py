"""Wire mocks with one mistake each."""

from __future__ import annotations

import os
import socket
import subprocess
import threading
import time

from catching import LEFT, caught_wire_mock
from honest_wire_mock import HonestWireMock

from lsds.errors import ConfigError, ConfigIssue
from lsds.testing import wire_mocks

LONG_S = 4.0


@caught_wire_mock(wire_mocks.check_building_does_no_io, "the constructor accessed .*socket.bind")
class ListensAtOnce(HonestWireMock):
    def __init__(self, options, context):
        super().__init__(options, context)
        self.listener = self.listen()


@caught_wire_mock(wire_mocks.check_building_does_no_io, "has not started raised AttributeError")
class ClosesOnlyWhatHasStarted(HonestWireMock):
    def close(self):
        self.listener.close()
        super().close()


@caught_wire_mock(wire_mocks.check_start_names_its_addresses, "'honest' as the address of 'tcp'")
class NamesNoPort(HonestWireMock):
    def start(self):
        super().start()
        return {"tcp": "honest"}


@caught_wire_mock(wire_mocks.check_start_names_its_addresses, "nothing answers at 127.*:1: ")
class NamesAnotherPort(HonestWireMock):
    def start(self):
        super().start()
        return {"tcp": f"{self.options.host}:1"}


@caught_wire_mock(wire_mocks.check_start_names_its_addresses, r"start\(\) returned NoneType")
class NamesNothing(HonestWireMock):
    def start(self):
        super().start()


@caught_wire_mock(wire_mocks.check_serves_a_connection, "has not accepted a client 2.0 s after the start")
class NeverAccepts(HonestWireMock):
    def serve(self, stop):
        stop.wait()


@caught_wire_mock(wire_mocks.check_survives_clients_that_leave, r"serve\(\) ended with .* after a client left 'tcp'")
class FailsWhenAClientLeaves(HonestWireMock):
    def answer(self, link):
        data = link.recv(4096)
        if not data:
            raise EOFError("the client is gone")


@caught_wire_mock(
    wire_mocks.check_survives_clients_that_leave, "has not accepted a client .* after 5 clients that left"
)
class AcceptsThreeClients(HonestWireMock):
    def serve(self, stop):
        for _ in range(3):
            self.links.append(self.listener.accept()[0])
        stop.wait()


@caught_wire_mock(wire_mocks.check_survives_garbage, r"serve\(\) ended with UnicodeDecodeError")
class DecodesStrictly(HonestWireMock):
    def answer(self, link):
        try:
            data = link.recv(4096)
        except OSError:
            data = b""
        if data:
            data.decode("ascii")
        else:
            self.links.remove(link)
            link.close()


@caught_wire_mock(wire_mocks.check_inject_names_the_kinds, "raised KeyError: 'kind'")
class NeedsAKind(HonestWireMock):
    def inject(self, fault):
        super().inject({"kind": fault["kind"]})


@caught_wire_mock(wire_mocks.check_inject_names_the_kinds, "names no kind that")
class HidesItsKinds(HonestWireMock):
    def inject(self, fault):
        if fault.get("kind") not in ("silent", "slow"):
            raise ConfigError("honest", [ConfigIssue("fault.kind", "is not known", "read the source")])


@caught_wire_mock(wire_mocks.check_inject_names_the_kinds, "raised nothing")
class TakesAnyFault(HonestWireMock):
    def inject(self, fault):
        return None


@caught_wire_mock(wire_mocks.check_refuses_an_address_in_use, "start.. at .* did not raise")
class SharesItsPort(HonestWireMock):
    def listen(self):
        return socket.create_server((self.options.host, self.options.port), reuse_port=True)


@caught_wire_mock(wire_mocks.check_refuses_an_address_in_use, "raised OSError")
class RaisesAForeignError(HonestWireMock):
    def start(self):
        self.listener = self.listen()
        return {"tcp": f"{self.options.host}:{self.listener.getsockname()[1]}"}


@caught_wire_mock(wire_mocks.check_ends_in_time, r"serve\(\) did not return within 2.0 s")
class ServesOn(HonestWireMock):
    def serve(self, stop):
        super().serve(stop)
        time.sleep(LONG_S)


@caught_wire_mock(wire_mocks.check_ends_in_time, r"close\(\) did not return within 2.0 s")
class ClosesSlowly(HonestWireMock):
    def close(self):
        super().close()
        time.sleep(LONG_S)


@caught_wire_mock(wire_mocks.check_ends_in_time, r"a second close\(\) raised ValueError")
class ClosesOnce(HonestWireMock):
    closed = False

    def close(self):
        if self.closed:
            raise ValueError("closed already")
        self.closed = True
        super().close()


@caught_wire_mock(wire_mocks.check_leaves_nothing, "holds thread left-over")
class LeaksAThread(HonestWireMock):
    def start(self):
        end = threading.Event()
        LEFT.append(end.set)
        threading.Thread(target=end.wait, name="left-over", daemon=True).start()
        return super().start()


@caught_wire_mock(wire_mocks.check_leaves_nothing, "holds file descriptor")
class LeaksItsClients(HonestWireMock):
    def close(self):
        LEFT.extend(link.close for link in self.links)
        self.links = []
        super().close()


@caught_wire_mock(wire_mocks.check_leaves_nothing, "holds .*child process")
class LeaksAChild(HonestWireMock):
    def start(self):
        child = subprocess.Popen(["sleep", "60"], stdin=subprocess.DEVNULL, cwd=os.sep)
        LEFT.extend((child.kill, child.wait))
        return super().start()


@caught_wire_mock(wire_mocks.check_starts_again, r"the second start\(\) failed: .*Address already in use")
class CannotBindAgain(HonestWireMock):
    def listen(self):
        listener = socket.socket()
        try:
            listener.bind((self.options.host, self.options.port))
        except OSError:
            listener.close()
            raise
        listener.listen()
        return listener
