"""The mock as a server: addresses, ports in use, misbehaving clients, unsupported faults."""

from __future__ import annotations

import contextlib
import os
import socket
import threading

import pytest
import serial
from lsds_mocks.wire.robotiq.options import HandEOptions
from lsds_mocks.wire.robotiq.server import RobotiqMock
from lsds_mocks.wire.robotiq.urcap import UrcapSession
from pydantic import ValidationError

from lsds.contracts import BuildContext
from lsds.errors import ConfigError, ConnectFailed, DeviceError
from tests.wire.robotiq.rig import ANY_PORTS, CLOCK, nothing_left, serving
from tests.wire.waiting import until

STATUS = bytes.fromhex("09 03 07 D0 00 01 85 CF")
ANSWER = bytes.fromhex("09 03 02 00 00 59 85")


@contextlib.contextmanager
def running(**options):
    """A mock in a thread of this process."""
    with nothing_left():
        mock = RobotiqMock(HandEOptions(**{**ANY_PORTS, **options}), BuildContext(CLOCK))
        addresses, stop = mock.start(), threading.Event()
        thread = threading.Thread(target=mock.serve, args=(stop,))
        thread.start()
        try:
            yield mock, addresses
        finally:
            stop.set()
            thread.join(5)
            mock.close()
            mock.close()


def on_tcp(addresses, face="tcp"):
    host, port = addresses[face].removeprefix("tcp://").rsplit(":", 1)
    return socket.create_connection((host, int(port)), 2)


def on_serial(addresses, **options):
    return serial.Serial(addresses["pty"], 115200, timeout=1, **options)


def answers(line, request=STATUS):
    """Whether a status request is answered, asked as often as a driver would."""
    send, read = (line.sendall, line.recv) if isinstance(line, socket.socket) else (line.write, line.read)

    def once():
        if isinstance(line, socket.socket):
            line.settimeout(0.3)
        send(request)
        try:
            return ANSWER in read(len(ANSWER))
        except TimeoutError:
            return False

    return until(once)


def test_the_link_and_the_ports_are_given_back(tmp_path):
    link = tmp_path / "gripper.tty"
    with running(pty=str(link)) as (_, addresses):
        assert addresses["pty"] == str(link)
        assert link.is_symlink()
        port = int(addresses["tcp"].rsplit(":", 1)[1])
    assert not os.path.lexists(link)
    with running(pty=str(link), tcp_port=port):
        pass


def test_a_link_left_behind_is_replaced(tmp_path):
    link = tmp_path / "gripper.tty"
    link.symlink_to("/dev/pts/does-not-exist")
    with running(pty=str(link)) as (_, addresses), on_serial(addresses) as line:
        assert answers(line)


def test_addresses_in_use_are_reported(tmp_path):
    link = str(tmp_path / "gripper.tty")
    with running(pty=link) as (_, addresses):
        with nothing_left():
            for options in ({"pty": link}, {"tcp_port": int(addresses["tcp"].rsplit(":", 1)[1])}):
                second = RobotiqMock(HandEOptions(**{**ANY_PORTS, **options}), BuildContext(CLOCK))
                with pytest.raises(ConnectFailed, match=r"another|in use"):
                    second.start()
        assert os.path.lexists(link), "the first one keeps its link"


def test_a_file_in_the_way_is_not_overwritten(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    mock = RobotiqMock(HandEOptions(**ANY_PORTS, pty=str(tmp_path / "notes.txt")), BuildContext(CLOCK))
    with pytest.raises(ConnectFailed, match="file of that name"):
        mock.start()
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_faces_can_be_left_out():
    with running(tcp_port=-1, urcap_port=-1) as (_, addresses):
        assert set(addresses) == {"pty"}


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.5", "example.org", "::"])
def test_only_loopback(host):
    with pytest.raises(ValidationError, match="loopback"):
        HandEOptions(host=host)


def test_a_missing_shared_plant_is_reported(tmp_path):
    with nothing_left():
        mock = RobotiqMock(HandEOptions(cell=str(tmp_path / "no.plant")), BuildContext(CLOCK))
        with pytest.raises(ConnectFailed, match="plant"):
            mock.start()
        mock.close()


@pytest.mark.parametrize("fault", [{"kind": "black-frame"}, {"kind": "dorp"}, {"kind": "gripper-fault", "code": 3}])
def test_faults_that_it_does_not_know(fault):
    mock = RobotiqMock(HandEOptions(), BuildContext(CLOCK))
    with pytest.raises(ConfigError):
        mock.inject(fault)


def test_an_unknown_fault_of_the_process_is_reported(tmp_path):
    with serving(tmp_path) as mock, pytest.raises(DeviceError, match="one of"):
        mock.inject("gripper-fault", code=2)


def test_garbage_half_frames_and_floods(tmp_path):
    with running(pty=str(tmp_path / "gripper.tty")) as (_, addresses):
        for line in (on_serial(addresses), on_tcp(addresses)):
            with line:
                write = line.sendall if isinstance(line, socket.socket) else line.write
                for rubbish in (b"\xff" * 4000, STATUS[:5], STATUS[:-1] + b"\0", bytes(range(256)) * 8, STATUS * 200):
                    write(rubbish)
                CLOCK.sleep_until(CLOCK.now() + 500_000_000)
                if isinstance(line, socket.socket):
                    line.settimeout(0.05)
                    with contextlib.suppress(TimeoutError):
                        while line.recv(65536):
                            pass
                else:
                    line.reset_input_buffer()
                assert answers(line)


def test_a_client_that_never_reads_does_no_harm():
    with running() as (_, addresses), on_tcp(addresses, "urcap") as deaf, on_tcp(addresses, "urcap") as other:
        deaf.settimeout(0.05)
        with contextlib.suppress(TimeoutError):
            for _ in range(200):
                deaf.sendall(b"GET POS\n" * 500)
        other.sendall(b"GET STA\n")
        assert other.recv(100) == b"STA 0\n"


def test_string_clients_may_send_anything():
    with running() as (_, addresses), on_tcp(addresses, "urcap") as client:
        client.sendall(os.urandom(5000).replace(b"\n", b"") + b"\n\n\r\n" + b"x" * 100_000)
        client.sendall(b"\nGET STA\n")
        assert until(lambda: b"STA 0\n" in client.recv(65536))


def test_clients_that_vanish():
    with running() as (_, addresses):
        for face in ("tcp", "urcap"):
            for _ in range(20):
                on_tcp(addresses, face).close()
            reset = on_tcp(addresses, face)
            reset.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            reset.close()
        for _ in range(10):
            on_serial(addresses).close()
        with on_serial(addresses) as line:
            assert answers(line)

        def again():
            with on_tcp(addresses) as client:
                return answers(client)

        assert until(again)


def test_a_second_client_on_tcp_is_hung_up_on_until_the_first_has_gone():
    with running() as (_, addresses), on_tcp(addresses) as first, on_tcp(addresses) as second:
        assert second.recv(1) == b""
        assert answers(first)


def test_a_serial_port_is_held_by_who_asks_for_it_exclusively(tmp_path):
    with running(pty=str(tmp_path / "gripper.tty")) as (_, addresses):
        with on_serial(addresses, exclusive=True) as first:
            with pytest.raises(serial.SerialException, match="exclusively"):
                on_serial(addresses, exclusive=True)
            assert answers(first)
        with on_serial(addresses, exclusive=True) as second:
            assert answers(second)


def test_a_client_at_another_baud_rate_is_not_understood(tmp_path):
    link, request = str(tmp_path / "port"), bytes.fromhex("090407D00003B1CE")
    with running(pty=link):
        for baud, answered in ((9600, False), (115200, True), (57600, False), (115200, True)):
            with serial.Serial(link, baud, timeout=0.3) as port:
                port.write(request)
                assert bool(port.read(11)) == answered, baud
    with running(pty=link, baud=0), serial.Serial(link, 9600, timeout=0.5) as port:
        port.write(request)
        assert port.read(11)


def test_busy_and_back(tmp_path):
    with running(pty=str(tmp_path / "gripper.tty")) as (mock, addresses):
        mock.inject({"kind": "busy", "for_s": 0.3})

        def taken():
            try:
                on_serial(addresses, exclusive=True).close()
            except serial.SerialException:
                return True
            return False

        assert until(taken)
        assert until(lambda: not taken())


def test_disconnect_and_back(tmp_path):
    with running(pty=str(tmp_path / "gripper.tty")) as (mock, addresses):
        line = on_serial(addresses)
        assert answers(line)
        mock.inject({"kind": "disconnect", "for_s": 0.3})
        assert until(lambda: not os.path.lexists(addresses["pty"]))
        with pytest.raises(OSError):
            assert line.in_waiting
        line.close()
        assert until(lambda: os.path.lexists(addresses["pty"]))
        with on_serial(addresses) as line:
            assert answers(line)
        with on_tcp(addresses) as client:
            assert answers(client)


@pytest.mark.parametrize("size", [10, 5000])
def test_the_body_of_an_http_request_sets_nothing(size):
    machine = Machine()
    session = UrcapSession(machine)
    for piece in (f"POST /{'a' * size}", " HTTP/1.1\r\nHost: a\r\n\r\n", "SET POS 0\n"):
        assert session.feed(piece.encode(), 0) == b""
    assert machine.written == []


class Machine:
    """Notes what is written."""

    command = bytes(16)

    def __init__(self):
        self.written = []

    def heard(self, now_ns):
        pass

    def write(self, offset, data, now_ns):
        self.written.append((offset, data))
