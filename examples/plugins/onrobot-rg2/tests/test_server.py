"""The wire mock as a client that writes its frames by hand sees it."""

from __future__ import annotations

import socket
import struct
import time

import pytest
from lsds.errors import ConfigError

from conftest import Box


def ask(link: socket.socket, data: bytes, unit: int = 65) -> bytes:
    """Send a request and return function code and data of the answer."""
    link.sendall(struct.pack(">HHHB", 7, 0, len(data) + 1, unit) + data)
    answer = link.recv(300)
    transaction, protocol, length, answered = struct.unpack(">HHHB", answer[:7])
    assert (transaction, protocol, length, answered) == (7, 0, len(answer) - 6, unit)
    return answer[7:]


def registers(link: socket.socket, address: int, count: int = 1) -> list[int]:
    answer = ask(link, struct.pack(">BHH", 3, address, count))
    assert answer[:2] == bytes([3, 2 * count])
    return list(struct.unpack(f">{count}H", answer[2:]))


def grip(link: socket.socket, tenths: int, force: int = 200, control: int = 16) -> bytes:
    return ask(link, struct.pack(">BHHBHHH", 16, 0, 3, 6, force, tenths, control))


@pytest.mark.parametrize("box", [{"object_mm": 40.0}], indirect=True)
def test_it_is_busy_while_it_moves_and_detects_a_grip(box: Box) -> None:
    with socket.create_connection(("127.0.0.1", box.port), 2.0) as link:
        assert registers(link, 267, 2) == [1100, 0]
        assert grip(link, 200) == struct.pack(">BHH", 16, 0, 3)
        assert registers(link, 268) == [1]
        # It ignores a grip while it is busy.
        grip(link, 1100)
        time.sleep(0.9)
        assert registers(link, 267, 2) == [400, 2]
        assert ask(link, struct.pack(">BHH", 6, 2, 8)) == struct.pack(">BHH", 6, 2, 8)
        assert registers(link, 267, 2) == [400, 2]


def test_stop_ends_a_motion_and_a_safety_switch_ends_all(box: Box) -> None:
    with socket.create_connection(("127.0.0.1", box.port), 2.0) as link:
        grip(link, 0)
        time.sleep(0.1)
        ask(link, struct.pack(">BHH", 6, 2, 8))
        stopped, status = registers(link, 267, 2)
        assert 0 < stopped < 1100
        assert status == 0
        box.server.inject({"kind": "safety-switch", "switch": 2})
        grip(link, 0)
        time.sleep(0.1)
        assert registers(link, 267, 2) == [stopped, 0b110000]


@pytest.mark.parametrize(
    ("request_", "unit", "answer"),
    [
        (struct.pack(">BHH", 4, 267, 1), 65, b"\x84\x01"),
        (struct.pack(">BHH", 3, 600, 1), 65, b"\x83\x02"),
        (struct.pack(">BHH", 3, 267, 0), 65, b"\x83\x03"),
        (struct.pack(">BHH", 6, 9, 1), 65, b"\x86\x02"),
        (struct.pack(">BHH", 6, 1, 1101), 65, b"\x86\x03"),
        (struct.pack(">BHH", 6, 2, 3), 65, b"\x86\x03"),
        (struct.pack(">BHHBHH", 16, 0, 3, 6, 1, 1), 65, b"\x90\x03"),
        (struct.pack(">BHH", 3, 267, 1), 66, b"\x83\x0b"),
        (b"\x03", 65, b"\x83\x03"),
    ],
)
def test_a_wrong_request_gets_the_exception_of_modbus(box: Box, request_: bytes, unit: int, answer: bytes) -> None:
    with socket.create_connection(("127.0.0.1", box.port), 2.0) as link:
        assert ask(link, request_, unit) == answer
        assert registers(link, 275) == [1100]


def test_requests_come_in_parts_and_together(box: Box) -> None:
    request = struct.pack(">HHHBBHH", 7, 0, 6, 65, 3, 275, 1)
    with socket.create_connection(("127.0.0.1", box.port), 2.0) as link:
        link.sendall(request[:5])
        time.sleep(0.1)
        link.sendall(request[5:] + request)
        received = b""
        while len(received) < 22:
            received += link.recv(100)
        assert received == struct.pack(">HHHBBBH", 7, 0, 5, 65, 3, 2, 1100) * 2


def test_a_fault_that_it_does_not_have_is_refused(box: Box) -> None:
    with pytest.raises(ConfigError, match="'fire' is not a fault of onrobot-rg2"):
        box.server.inject({"kind": "fire"})
    with pytest.raises(ConfigError, match="1 or 2"):
        box.server.inject({"kind": "safety-switch", "switch": 3})
