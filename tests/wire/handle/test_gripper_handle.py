"""`lsds.testing.wire_mock` with the Hand-E, driven by other people's Modbus clients over TCP."""

from __future__ import annotations

import time

import pytest

from lsds.errors import ConfigError, ConnectFailed, DeviceError
from lsds.testing import wire_mock
from tests.wire.waiting import until

pymodbus = pytest.importorskip("pymodbus.client", reason="pymodbus is not installed: pip install pymodbus")
ModbusIOException = pytest.importorskip("pymodbus.exceptions").ModbusIOException
ACTIVE = 0x31
OPEN, CLOSED = 0x0000, 0x00FF


@pytest.fixture(scope="module")
def served():
    with wire_mock("hand-e", transport="tcp", activated=True) as mock:
        yield mock
        assert mock.process.complaints == ""


@pytest.fixture
def gripper(served):
    from pymodbus import FramerType

    client = pymodbus.ModbusTcpClient(
        served.host, port=served.port, framer=FramerType.RTU, timeout=0.2, retries=0, reconnect_delay=0
    )
    # The port takes one client; the mock may still be closing the last one.
    assert until(lambda: client.connect() and answers(client))
    yield client
    client.close()


@pytest.fixture
def mock(served, gripper):
    go(gripper, OPEN)
    assert until(lambda: served.truth.aperture_m > 0.0499)
    served.mark()
    return served


def go(client, position, speed=0xFF):
    return client.write_registers(1000, [0x0900, position, speed << 8], device_id=9)


def answers(client):
    from pymodbus.exceptions import ModbusException

    try:
        return not client.read_input_registers(2000, count=1, device_id=9).isError()
    except (ModbusException, OSError):
        client.close()
        client.connect()
        return False


def test_it_starts_in_less_than_two_seconds_on_a_free_port():
    start = time.monotonic()
    with wire_mock("hand-e", transport="tcp") as one, wire_mock("hand-e", transport="tcp") as other:
        assert time.monotonic() - start < 4.0  # both of them
        assert one.port != other.port
        assert one.address == f"tcp://127.0.0.1:{one.port}"


def test_a_drop_is_switched_on_and_off_while_it_runs(mock, gripper):
    with mock.fault("drop"):
        assert not answers(gripper)
        assert not answers(gripper)
    assert answers(gripper)


def test_minimalmodbus_meets_the_same_faults(tmp_path):
    minimalmodbus = pytest.importorskip("minimalmodbus", reason="minimalmodbus is not installed")
    with wire_mock("hand-e", transport="pty", pty=tmp_path / "hand.tty", activated=True) as mock:
        client = minimalmodbus.Instrument(mock.address, 9)
        client.serial.baudrate, client.serial.timeout = 115200, 0.2
        with mock.fault("crc"), pytest.raises(minimalmodbus.InvalidResponseError):
            client.read_register(2000)
        assert client.read_register(2000) >> 8 == ACTIVE
        assert mock.received[-1].meaning == "read 2000"
        assert mock.received[-1].face == "pty"
        client.serial.close()


@pytest.mark.parametrize("kind", ["disconnect", "busy"])
def test_a_lost_port_comes_back_when_the_fault_ends(mock, gripper, kind):
    with mock.fault(kind, face="tcp"):
        assert not answers(gripper)
        assert not answers(gripper)
    gripper.close()
    assert gripper.connect()
    assert answers(gripper)


def test_frozen_registers_follow_again_when_the_fault_ends(mock, gripper):
    with mock.fault("freeze"):
        go(gripper, CLOSED)
        mock.stopped_within(0.1)
        assert mock.truth.aperture_m > 0.0499
    go(gripper, CLOSED)
    assert until(lambda: mock.truth.aperture_m < 1e-3)


def test_another_fault_of_the_same_kind_goes_on(mock, gripper):
    with mock.fault("freeze"):
        with mock.fault("freeze"):
            pass
        go(gripper, CLOSED)
        time.sleep(0.1)
        assert mock.truth.aperture_m > 0.0499


def test_severity_sets_the_share_of_lost_answers(mock, gripper):
    with mock.fault("drop", severity=1):
        assert sum(answers(gripper) for _ in range(20)) >= 10  # 1 of 20 is lost; a lost one costs a new connection
    with mock.fault("drop", severity=5):
        assert not answers(gripper)


def test_severity_of_a_delay(mock, gripper):
    with mock.fault("delay", severity=4):
        start = time.monotonic()
        assert answers(gripper)
        assert time.monotonic() - start > 0.1


def test_the_third_write_to_a_register_starts_a_fault(mock, gripper):
    with mock.fault("drop", when="write 1001", nth=3, count=1):
        assert not go(gripper, 10).isError()
        assert answers(gripper)
        assert not go(gripper, 20).isError()
        with pytest.raises(ModbusIOException, match="No response"):
            go(gripper, 30)
        assert not go(gripper, 40).isError()


def test_the_frame_that_starts_a_freeze_is_ignored_already(mock, gripper):
    with mock.fault("freeze", when="write 1000 0x00FF"):
        go(gripper, CLOSED)
        time.sleep(0.1)
        assert mock.truth.target_m > 0.0499


def test_received_has_time_bytes_and_meaning(mock, gripper):
    before, number = time.monotonic_ns(), len(mock.received)
    go(gripper, CLOSED)
    gripper.read_input_registers(2000, count=3, device_id=9)
    with pytest.raises(ModbusIOException, match="No response"):
        gripper.write_register(1003, 5, device_id=7)
    gripper.socket.sendall(b"\x09\x03garbage")
    assert until(lambda: len(mock.received) == number + 4)
    write, read, stranger, damaged = mock.received[number:]
    assert write.data.hex(" ") == "09 10 03 e8 00 03 06 09 00 00 ff ff 00 02 69"
    assert write.meaning == "write 1000 1001 1002: 0x0900 0x00FF 0xFF00"
    assert before < write.t_ns < read.t_ns < time.monotonic_ns()
    assert (read.face, read.meaning) == ("tcp", "read 2000 2001 2002")
    assert stranger.meaning == "slave 7: write 1003: 0x0005"
    assert (damaged.data, damaged.meaning) == (b"\x09\x03garbage", "damaged: no request with a valid CRC")


def test_truth_is_the_plant_and_no_register():
    with wire_mock("hand-e", transport="tcp", activated=True, object_mm=20.0) as mock:
        assert (mock.truth.object, mock.truth.normal_n, mock.truth.moving) == ("free", 0.0, False)
        client = pymodbus.ModbusTcpClient(mock.host, port=mock.port, framer="rtu")
        assert client.connect()
        go(client, CLOSED)
        assert until(lambda: mock.truth.object == "held" and not mock.truth.moving)
        assert mock.truth.normal_n > 10
        assert 0.005 < mock.truth.aperture_m < 0.020
        mock.never_opened()
        client.close()
        with pytest.raises(AttributeError, match="no 'pose'; it has t_ns, aperture_m"):
            mock.truth.pose  # noqa: B018


def test_never_opened_names_opening_and_cause(mock, gripper):
    go(gripper, CLOSED)
    assert until(lambda: mock.truth.aperture_m < 1e-3)
    mock.never_opened()
    go(gripper, 100)
    assert until(lambda: mock.truth.aperture_m > 0.02)
    # It closes again: the assertion regards the whole course.
    go(gripper, CLOSED)
    assert until(lambda: mock.truth.aperture_m < 1e-3)
    with pytest.raises(AssertionError, match=r"opened from 0.00 mm to .* write 1000 1001 1002: 0x0900 0x0064 0xFF00"):
        mock.never_opened()
    mock.mark()
    mock.never_opened()


def test_stopped_within_names_the_motion(mock, gripper):
    go(gripper, CLOSED, speed=0)  # takes 2.5 s
    with pytest.raises(AssertionError, match=r"still moved 0\.20. s after .*limit 0.2 s"):
        mock.stopped_within(0.2)
    gripper.write_registers(1000, [0x0100], device_id=9)
    mock.mark()
    mock.stopped_within(0.1)


def test_errors_name_the_remedy(mock):
    with pytest.raises(DeviceError, match="did you mean 'drop'"), mock.fault("dropp"):
        pass
    with pytest.raises(DeviceError, match="'freeze' has no severity"), mock.fault("freeze", severity=3):
        pass
    with pytest.raises(DeviceError, match="give one of them"), mock.fault("drop", severity=3, probability=0.5):
        pass
    with pytest.raises(DeviceError, match="no fault has the name 'x'"):
        mock.process.request({"request": "end", "name": "x"})
    with pytest.raises(DeviceError, match="'sing' is no request"):
        mock.process.request({"request": "sing"})
    with pytest.raises(ConfigError, match="'tpc' is no face of this mock"), wire_mock("hand-e", transport="tpc"):
        pass
    with pytest.raises(ConnectFailed, match="hand-f"), wire_mock("hand-f"):
        pass
    with pytest.raises(DeviceError, match="has not started"):
        wire_mock("hand-e").address  # noqa: B018
    with wire_mock("hand-e", transport="pty") as other, pytest.raises(DeviceError, match="is not a TCP port"):
        other.port  # noqa: B018


def test_a_block_that_fails_keeps_its_error_when_the_mock_has_ended():
    def ending(mock):
        with mock.fault("drop"):
            mock.stop()
            raise ZeroDivisionError

    with wire_mock("hand-e", transport="tcp") as mock, pytest.raises(ZeroDivisionError):
        ending(mock)
