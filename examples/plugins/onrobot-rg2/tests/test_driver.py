"""The driver on a Compute Box: what it writes, one clear error for each failure, and fingers that never open by one."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Callable

import pytest
from lsds.clock import VirtualClock, WallClock
from lsds.contracts import BuildContext, Contact, GripperCommand, GripperState, Lifecycle
from lsds.errors import ConnectFailed, DeviceError, DeviceFault, DeviceTimeout, LsdsError, ProtocolFault, StaleData
from lsds.registry import PluginHost

from conftest import Box
from lsds_onrobot_rg2.device import LoneFingers, Rg2Device
from lsds_onrobot_rg2.gripper import Rg2Gripper
from lsds_onrobot_rg2.mock import DeviceBus
from lsds_onrobot_rg2.pump import Motion, Pump

MS = 1_000_000


def send(gripper: Rg2Gripper, aperture_m: float, force_n: float = 20.0) -> GripperCommand:
    return gripper.command(GripperCommand(aperture_m, 0.1, force_n, time.monotonic_ns() + 5_000_000_000))


def wait(done: Callable[[], bool], timeout_s: float = 5.0) -> None:
    deadline = time.monotonic() + timeout_s
    while not done():
        assert time.monotonic() < deadline, "timeout"
        time.sleep(0.01)


def at_rest(gripper: Rg2Gripper, aperture_m: float) -> Callable[[], bool]:
    def is_there() -> bool:
        state = gripper.read()
        return not state.moving and abs(state.aperture_m - aperture_m) < 2e-4

    return is_there


def error_of(gripper: Rg2Gripper, timeout_s: float = 3.0) -> LsdsError:
    """Return the first error of `read`."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        try:
            gripper.read()
        except LsdsError as error:
            return error
        time.sleep(0.01)
    raise AssertionError("no error")


def aperture_m(box: Box) -> float:
    """Return where the fingers really are."""
    assert box.server.device is not None
    return (box.server.device.read(275) or 0) * 1e-4


# -- what it does ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("box", [{"object_mm": 40.0}], indirect=True)
def test_it_closes_on_an_object_and_reports_the_grip(box: Box) -> None:
    gripper = box.armed()
    sent = send(gripper, 0.03004, 12.34)
    assert (sent.aperture_m, sent.force_n, sent.speed_m_s) == (0.03, 12.3, 0.1)
    wait(lambda: gripper.read().contact is Contact.CLOSING)
    state: GripperState = gripper.read()
    assert state.aperture_m == pytest.approx(0.04)
    assert state.target_m == pytest.approx(0.03)
    assert not state.moving


def test_a_command_during_a_motion_replaces_it(box: Box) -> None:
    gripper = box.armed()
    send(gripper, 0.0)
    wait(lambda: gripper.read().moving)
    send(gripper, 0.09)
    wait(at_rest(gripper, 0.09))


def test_the_same_command_after_a_stop_moves_again(box: Box) -> None:
    gripper = box.armed()
    send(gripper, 0.0)
    wait(lambda: gripper.read().aperture_m < 0.09)
    gripper.stop()
    wait(lambda: not gripper.read().moving)
    assert gripper.read().target_m > 0.02
    send(gripper, 0.0)
    wait(at_rest(gripper, 0.0))


def test_a_command_soon_after_another_is_not_lost_to_a_late_busy_flag() -> None:
    clock, device, pump = _simulated()
    real = device.read
    began_ns = clock.now()

    def read(address: int) -> int | None:
        late = clock.now() - began_ns < 50 * MS
        return 0 if address == 268 and late else real(address)

    device.read = read  # type: ignore[method-assign]
    for target_m in (0.0, 0.09):
        pump.move(Motion(target_m, 20.0, clock.now() + 3000 * MS))
        pump.step(clock.now())
        clock.sleep_until(clock.now() + 20 * MS)
    for _ in range(100):
        clock.sleep_until(clock.now() + 20 * MS)
        pump.step(clock.now())
    assert device.read(275) == 900


@pytest.mark.parametrize("box", [{"offset_mm": 5.0}], indirect=True)
def test_apertures_are_those_between_the_fingertips(box: Box) -> None:
    gripper = box.armed()
    send(gripper, 0.03)
    wait(at_rest(gripper, 0.03))
    assert box.server.device is not None
    assert box.server.device.read(267) == 400
    assert box.server.device.read(275) == 300


# -- what fails -----------------------------------------------------------------------------------------------


def test_a_closed_port_is_named() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    box = _lonely(port)
    with pytest.raises(ConnectFailed, match=rf"onrobot-rg2: no connection to 127\.0\.0\.1:{port} \(check power, cable"):
        box.driver().connect()


@pytest.mark.parametrize(
    ("kind", "error", "words"),
    [
        (
            "silent",
            DeviceTimeout,
            r"no valid answer .*unit 65 to reading registers 258 to 275 .*check the gripper's",
        ),
        ("exception", ProtocolFault, r"unit 65: Modbus exception 11 to reading .*check the cable between Compute Box"),
        ("wrong-answer", ProtocolFault, r"17 registers in answer to reading registers 258 to 275 .*firmware"),
    ],
)
def test_a_failure_is_one_clear_error_at_connect_and_later(
    box: Box, kind: str, error: type[DeviceError], words: str
) -> None:
    gripper = box.armed()
    box.server.inject({"kind": kind})
    later = error_of(gripper)
    assert isinstance(later, StaleData)
    assert isinstance(later.__cause__, error)
    second = box.driver()
    with pytest.raises(error, match=words):
        second.connect()
    assert second.lifecycle is Lifecycle.NEW
    # The first driver recovers by itself, and needs no command to hold.
    box.server.inject({"kind": "recovered"})
    wait(lambda: _reads(gripper))


@pytest.mark.parametrize("kind", ["silent", "exception", "wrong-answer"])
def test_nothing_opens_because_a_message_failed(box: Box, kind: str) -> None:
    gripper = box.armed()
    send(gripper, 0.02)
    wait(at_rest(gripper, 0.02))
    box.server.inject({"kind": kind})
    error_of(gripper)
    with pytest.raises(StaleData, match="no status for 500 ms"):
        send(gripper, 0.11)
    for call in (gripper.stop, gripper.disarm, gripper.close):
        call()
        assert aperture_m(box) == pytest.approx(0.02)
    box.server.inject({"kind": "recovered"})
    time.sleep(0.2)
    assert aperture_m(box) == pytest.approx(0.02)


def test_a_stop_that_is_lost_is_sent_again(box: Box) -> None:
    gripper = box.armed(timeout_s=0.05)
    send(gripper, 0.0)
    wait(lambda: gripper.read().moving)
    box.server.inject({"kind": "exception"})
    gripper.stop()
    box.server.inject({"kind": "recovered"})
    time.sleep(0.2)
    stopped_m = aperture_m(box)
    time.sleep(0.2)
    assert 0.02 < aperture_m(box) == stopped_m


@pytest.mark.parametrize("switch", [1, 2])
def test_a_safety_switch_is_a_fault_with_its_remedy(box: Box, switch: int) -> None:
    gripper = box.armed()
    send(gripper, 0.02)
    wait(at_rest(gripper, 0.02))
    box.server.inject({"kind": "safety-switch", "switch": switch})
    error = error_of(gripper)
    assert isinstance(error, DeviceFault)
    assert f"safety circuit {switch} has tripped" in str(error)
    assert "switch the gripper off and on" in str(error)
    with pytest.raises(DeviceFault):
        send(gripper, 0.11)
    gripper.close()
    second = box.driver()
    second.connect()
    with pytest.raises(DeviceFault, match="has tripped"):
        second.arm()
    assert aperture_m(box) == pytest.approx(0.02)


def test_fingers_that_touch_beyond_zero_are_closed() -> None:
    clock, device, pump = _simulated()
    real = device.read
    device.read = lambda address: 0xFFFB if address == 275 else real(address)  # type: ignore[method-assign]
    pump.step(clock.now())
    assert pump.error is None
    assert pump.status is not None
    assert pump.status.aperture_m == 0.0


def test_another_gripper_at_this_unit_is_named() -> None:
    with pytest.raises(ProtocolFault, match=r"a width of 160\.0 mm .*is an RG2"):
        _raise(_pump(width_tenths=1600))


def test_garbage_instead_of_modbus_is_a_timeout_and_not_a_crash() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        box = _lonely(listener.getsockname()[1])

        def serve() -> None:
            client, _ = listener.accept()
            with client:
                request = client.recv(100)
                client.sendall(request[:2] + struct.pack(">HHBB", 0, 3, 65, 7) + b"\xff" * 20)
                client.recv(100)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        with pytest.raises((DeviceTimeout, ProtocolFault), match="reading registers 258 to 275"):
            box.driver().connect()
        thread.join(2.0)


# -- the cycle, on simulated time -----------------------------------------------------------------------------


def test_a_motion_that_is_due_too_late_is_not_started() -> None:
    clock, device, pump = _simulated()
    pump.move(Motion(0.0, 20.0, clock.now() + 10 * MS))
    clock.sleep_until(clock.now() + 20 * MS)
    pump.step(clock.now())
    assert pump.error is None
    assert pump.target_m is None
    assert device.read(268) == 0


def test_a_motion_that_was_stopped_at_once_is_not_sent_again() -> None:
    clock, device, pump = _simulated()
    pump.move(Motion(0.05, 20.0, clock.now() + 1000 * MS))
    pump.step(clock.now())
    pump.stop()
    for _ in range(20):
        clock.sleep_until(clock.now() + 20 * MS)
        pump.step(clock.now())
    assert device.read(275) == 1100


def test_a_grip_that_the_gripper_ignored_is_sent_again() -> None:
    clock, device, pump = _simulated()
    sent: list[int] = []
    real = device.write
    # The gripper is busy for another client, and ignores the first grip.
    device.write = lambda address, value: sent.append(value) if address == 2 and not sent else real(address, value)  # type: ignore[method-assign]
    pump.move(Motion(0.05, 20.0, clock.now() + 1000 * MS))
    for _ in range(50):
        clock.sleep_until(clock.now() + 20 * MS)
        pump.step(clock.now())
    assert sent == [16]
    assert device.read(275) == 500


def test_a_repeated_command_does_not_interrupt_the_motion() -> None:
    clock, device, pump = _simulated()
    written: list[int] = []
    real = device.write

    def write(address: int, value: int) -> None:
        written.extend([value] if address == 2 else [])
        real(address, value)

    device.write = write  # type: ignore[method-assign]
    for _ in range(50):
        pump.move(Motion(0.05, 20.0, clock.now() + 100 * MS))
        clock.sleep_until(clock.now() + 20 * MS)
        pump.step(clock.now())
    assert written == [16]
    assert device.read(275) == 500


def _simulated() -> tuple[VirtualClock, Rg2Device, Pump]:
    clock = VirtualClock()
    device = Rg2Device(LoneFingers(clock, 0.11), clock)
    return clock, device, Pump("onrobot-rg2", DeviceBus(device))


def _pump(width_tenths: int) -> Pump:
    clock = VirtualClock()
    pump = Pump("onrobot-rg2", DeviceBus(Rg2Device(LoneFingers(clock, width_tenths * 1e-4), clock)))
    pump.step(clock.now())
    return pump


def _raise(pump: Pump) -> None:
    assert pump.error is not None
    raise pump.error


def _reads(gripper: Rg2Gripper) -> bool:
    try:
        gripper.read()
    except StaleData:
        return False
    return True


def _lonely(port: int) -> Box:
    """Return a box whose server does not run."""
    host = PluginHost()
    return Box(host.build("wire_mock", "onrobot-rg2", {}, BuildContext(WallClock())), port, host)
