"""Other people's clients, unmodified, against the mock's own process."""

from __future__ import annotations

import socket
import time

import minimalmodbus
import pymodbus.client
import pyrobotiqgripper
import pytest
from pymodbus import FramerType
from pyrobotiqgripper.exceptions import GripperFaultError

from tests.wire.robotiq.rig import serving
from tests.wire.waiting import until


@pytest.fixture(scope="module")
def mock(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("hand"), object_mm=20, activation_s=0.4) as mock:
        yield mock
        assert mock.complaints == ""


@pytest.fixture(scope="module")
def free_mock(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("free"), activation_s=0.4) as mock:
        yield mock
        assert mock.complaints == ""


def tcp(mock):
    host, port = mock.addresses["tcp"].removeprefix("tcp://").split(":")
    return host, int(port)


@pytest.fixture(params=["pty", "tcp"])
def client(request, free_mock):
    if request.param == "pty":
        client = pyrobotiqgripper.RobotiqGripper(com_port=free_mock.addresses["pty"])
    else:
        host, port = tcp(free_mock)
        client = pyrobotiqgripper.RobotiqGripper(
            connection_type=pyrobotiqgripper.GRIPPER_MODE_RTU_VIA_TCP, tcp_host=host, tcp_port=port
        )
    yield client
    client.disconnect()


def test_pyrobotiqgripper_activates_moves_and_calibrates(client):
    client.activate()
    assert client.isActivated()
    client.open()
    assert client.position() == 3
    client.close()
    assert client.position() == 228
    client.calibrate_mm(closemm=0, openmm=50)
    client.move_mm(25)
    assert client.position_mm() == pytest.approx(25, abs=0.3)
    client.move(100, wait=False)
    client.stop()
    assert client.status()["gGTO"] == 0


def faulty(client):
    try:
        client.readStatus()
    except GripperFaultError as error:
        return error.code in (0x0B, 0x0F)
    return False


def test_pyrobotiqgripper_releases_and_recovers(client, free_mock):
    client.activate()
    client.move(50)
    free_mock.inject("gripper-fault", code=0x0B, count=1)
    assert until(lambda: faulty(client))
    client.activate()
    client.open()
    assert client.position() == 3


def test_pyrobotiqgripper_finds_an_object(tmp_path):
    with serving(tmp_path, object_mm=20, activated=True, aperture_mm=50) as mock:
        client = pyrobotiqgripper.RobotiqGripper(com_port=mock.addresses["pty"])
        client.start()
        client.close(force=0)
        status = client.status()
        assert status["gOBJ"] == 2
        assert 228 - 20 / 50 * 225 < client.position() < 228 - 15 / 50 * 225
        client.disconnect()


def test_minimalmodbus(free_mock):
    gripper = minimalmodbus.Instrument(free_mock.addresses["pty"], 9)
    gripper.serial.baudrate = 115200
    gripper.serial.timeout = 0.5
    gripper.write_registers(1000, [0, 0, 0])
    gripper.write_registers(1000, [0x0100, 0, 0])
    assert until(lambda: gripper.read_register(2000, functioncode=4) >> 8 == 0x31)
    gripper.write_registers(1000, [0x0900, 0x00FF, 0xFFFF])
    assert until(lambda: gripper.read_registers(2000, 3, functioncode=3) == [0xF900, 0x00FF, 228 << 8])
    gripper.write_register(1001, 3, functioncode=6)
    assert until(lambda: gripper.read_registers(2000, 3)[2] >> 8 == 3)
    with pytest.raises(minimalmodbus.NoResponseError):
        gripper.read_register(3000)
    gripper.serial.close()


@pytest.mark.parametrize("face", ["pty", "tcp"])
def test_pymodbus(free_mock, face):
    if face == "pty":
        client = pymodbus.client.ModbusSerialClient(free_mock.addresses["pty"], baudrate=115200, timeout=1)
    else:
        host, port = tcp(free_mock)
        client = pymodbus.client.ModbusTcpClient(host, port=port, framer=FramerType.RTU, timeout=1)
    assert client.connect()
    client.write_registers(1000, [0, 0, 0], device_id=9)
    client.write_registers(1000, [0x0100], device_id=9)
    assert until(lambda: client.read_input_registers(2000, count=1, device_id=9).registers[0] >> 8 == 0x31)
    answer = client.readwrite_registers(
        read_address=2000, read_count=3, write_address=1000, values=[0x0900, 128, 0xFF00], device_id=9
    )
    assert answer.registers[0] >> 8 == 0x39
    assert until(lambda: client.read_holding_registers(2000, count=3, device_id=9).registers[0] >> 8 == 0xF9)
    client.close()


class Strings:
    """A client of the string server as they are found in the field: one read for one answer, no framing."""

    def __init__(self, mock):
        host, port = mock.addresses["urcap"].split(":")
        self.socket = socket.create_connection((host, int(port)), 2)

    def ask(self, text):
        self.socket.sendall(text.encode())
        return self.socket.recv(1024).decode()

    def get(self, name):
        key, value = self.ask(f"GET {name}\n").split()
        assert key == name
        return int(value)

    def set(self, **values):
        assert self.ask("SET " + " ".join(f"{k} {v}" for k, v in values.items()) + "\n") == "ack"


@pytest.fixture
def strings(mock):
    client = Strings(mock)
    yield client
    client.socket.close()


def test_a_urcap_client_resets_activates_and_grips(strings):
    strings.set(ACT=0)
    strings.set(ATR=0)
    assert until(lambda: strings.get("ACT") == 0 and strings.get("STA") == 0)
    strings.set(ACT=1)
    assert until(lambda: strings.get("ACT") == 1 and strings.get("STA") == 3)
    # The object, of 20 mm, is there by now.
    strings.set(POS=255, SPE=255, FOR=0, GTO=1)
    assert until(lambda: strings.get("PRE") == 255)
    assert until(lambda: strings.get("OBJ") == 2)
    assert strings.get("POS") == pytest.approx(228 - 20 / 50 * 225, abs=8)
    strings.set(GTO=0)
    strings.set(ACT=0)
    assert strings.get("FLT") == 0


def test_a_urcap_client_moves(free_mock):
    client = Strings(free_mock)
    client.set(ACT=0)
    client.set(ACT=1)
    assert until(lambda: client.get("ACT") == 1 and client.get("STA") == 3)
    client.set(POS=255, SPE=255, FOR=0, GTO=1)
    assert until(lambda: client.get("PRE") == 255)
    assert until(lambda: client.get("OBJ") != 0)
    assert client.get("POS") == 228
    assert (client.get("SPE"), client.get("FOR"), client.get("GTO")) == (255, 0, 1)
    client.socket.close()


def test_several_requests_in_one_write_are_answered_in_one_piece(strings):
    assert strings.ask("GET ACT\nGET SPE\nGET FOR\n").count("\n") == 3
    assert strings.ask("SET SPE 7\nGET SPE\n") == "ackSPE 7\n"


def test_both_spellings_of_the_release_direction(strings):
    strings.set(ARD=1)
    assert strings.get("ADR") == 1
    strings.set(ADR=0)
    assert strings.get("ARD") == 0


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("GET XYZ\n", "XYZ ?\n"),
        ("SET XYZ 1\n", "?\n"),
        ("SET POS 256\n", "?\n"),
        ("SET POS -1\n", "?\n"),
        ("SET ACT 2\n", "?\n"),
        ("SET POS\n", "?\n"),
        ("HELLO\n", "?\n"),
        ("GET \xff\n", "?? ?\n"),
    ],
)
def test_what_the_string_server_does_not_understand(strings, request_, answer):
    assert strings.ask(request_) == answer


def test_a_line_may_come_in_pieces(strings):
    strings.socket.sendall(b"GET S")
    time.sleep(0.02)
    assert strings.ask("PE\n").startswith("SPE ")
