"""The transports against scripted servers: answers that come late, twice, or are of another request."""

from __future__ import annotations

import contextlib
import socket
import threading

import pytest
from lsds_drivers.robotiq import modbus
from lsds_drivers.robotiq.modbus import ModbusTransport
from lsds_drivers.robotiq.urcap import UrcapTransport

from lsds.errors import DeviceError, DeviceFault, DeviceTimeout, ProtocolFault
from tests.wire.robotiq.rig import CLOCK, framed


@contextlib.contextmanager
def scripted(converse):
    """A server that holds one conversation in a thread; gives its port."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve():
            connection, _ = listener.accept()
            with connection, contextlib.suppress(OSError):
                converse(connection)

        thread = threading.Thread(target=serve)
        thread.start()
        yield listener.getsockname()[1]
        thread.join(5)
        assert not thread.is_alive()


def status(function, position):
    return bytes.fromhex(framed(f"09 {function:02X} 06 F9 00 00 {position:02X} {position:02X} 00"))


def one_late(connection):
    """Answer each request only when the next one comes, or 10 ms later; the first answer stays late."""
    pending, number = None, 0
    while True:
        connection.settimeout(None if pending is None or number == 1 else 0.01)
        try:
            request = connection.recv(100)
        except TimeoutError:
            connection.sendall(pending)
            pending = None
            continue
        if not request:
            return
        if pending is not None:
            connection.sendall(pending)
        number += 1
        pending = status(request[1], number)


def test_an_answer_that_is_late_once_does_not_make_all_others_late():
    with scripted(one_late) as port:
        wire = ModbusTransport("hand-e", f"tcp://127.0.0.1:{port}", 9, 115200, 0.05)
        wire.open(1)
        found = []
        for _ in range(8):
            try:
                found.append(wire.read().position)
            except DeviceError as error:
                found.append(type(error))
        wire.close()
    assert found[:2] == [DeviceTimeout, ProtocolFault]
    assert found[2:] == [3, 4, 5, 6, 7, 8]


def strings(position):
    return f"ACT 1\nGTO 1\nSTA 3\nOBJ 3\nFLT 0\nPRE {position}\nPOS {position}\n".encode()


def test_strings_that_came_unasked_are_no_answer():
    def converse(connection):
        for position in (10, 20):
            connection.recv(200)
            connection.sendall(strings(position))
            more.wait(5)
            if position == 10:
                connection.sendall(strings(99))
                pushed.set()

    more, pushed = threading.Event(), threading.Event()
    with scripted(converse) as port:
        wire = UrcapTransport("hand-e-urcap", "127.0.0.1", port, 1.0, CLOCK)
        wire.open(1)
        assert wire.read().position == 10
        more.set()
        assert pushed.wait(5)
        CLOCK.sleep_until(CLOCK.now() + 50_000_000)
        assert wire.read().position == 20
        wire.close()


@pytest.mark.parametrize(
    ("answer", "error"),
    [
        (strings("?"), DeviceFault),
        (strings("256"), ProtocolFault),
        (strings("-1"), ProtocolFault),
        (strings("5").replace(b"GTO", b"OTG"), ProtocolFault),
        (strings("5") * 2, ProtocolFault),
        (b"\xff" * 2000, ProtocolFault),
        (b"ACT 1\n", ProtocolFault),
    ],
)
def test_strings_that_cannot_be_right(answer, error):
    def converse(connection):
        connection.recv(200)
        connection.sendall(answer)
        connection.recv(200)

    with scripted(converse) as port:
        wire = UrcapTransport("hand-e-urcap", "127.0.0.1", port, 0.2, CLOCK)
        wire.open(1)
        with pytest.raises(error) as raised:
            wire.read()
        assert raised.value.remedy
        wire.close()


def test_an_answer_counts_as_that_to_the_oldest_open_request_unless_quick_ones_follow_each_other(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(modbus.time, "monotonic", lambda: now[0])
    transport = modbus.ModbusTransport("fake", "tcp://nowhere:1", 9, 115200, 0.1)

    def ask(way, answered_after_s):
        began = now[0]
        transport._open.append((way, began))
        now[0] += answered_after_s or 0.1
        if answered_after_s:
            transport._attribute(way, began)
        return round(transport.waited_s, 3)

    assert [ask("a", 0.004), ask("b", 0.004)] == [0.004, 0.004]
    transport._quick = 0
    ask("a", None)
    # The answer may be the late one to the lost request.
    assert ask("a", 0.05) == 0.15
    assert ask("b", 0.004) == 0.004, "only one request of this form is open"
    ask("a", None)
    assert [ask("a", 0.004) for _ in range(4)][-1] == 0.004
