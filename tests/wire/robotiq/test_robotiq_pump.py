"""Requests of the I/O thread: expiry, the newest command, outages, a gripper that was reset."""

from __future__ import annotations

import contextlib
import threading

import pytest
from lsds_drivers.robotiq.gripper import RobotiqGripper
from lsds_drivers.robotiq.options import GripperOptions
from lsds_drivers.robotiq.registers import ACTIVATE, GO_TO, Activation, Detection, Status

from lsds.clock import nanoseconds
from lsds.errors import ConnectFailed, DeviceFault, DeviceTimeout, LifecycleError, ProtocolFault, StaleData
from tests.wire.robotiq.rig import CLOCK, nothing_left, to
from tests.wire.waiting import until

REST = Status(True, True, Activation.ACTIVE, Detection.ARRIVED, 0, 0, 138, 138, 0)


class FakeTransport:
    """A gripper that echoes; `trouble` is raised by every request while it is there."""

    def __init__(self):
        self.status = REST
        self.writes = []
        self.trouble = None
        self.open_trouble = None
        self.is_open = False
        self.hangs = False
        self.answer_s = self.waited_s = 0.0
        self.gate = threading.Event()
        self.gate.set()

    def open(self, timeout_s):
        if self.open_trouble:
            raise self.open_trouble
        self.is_open = True

    def close(self):
        self.is_open = False

    def read(self):
        self._ask()
        status = self.status
        CLOCK.sleep_until(CLOCK.now() + nanoseconds(self.answer_s))
        return status

    def write(self, action, motion):
        self._ask()
        self.writes.append((action, motion))
        if motion is not None:
            self.status = self.status._replace(echo=motion.position, going=True)

    def hold(self):
        """Let the next request hang until the gate is opened; return when it does."""
        self.gate.clear()
        assert until(lambda: self.hangs)

    def _ask(self):
        self.hangs = not self.gate.is_set()
        self.gate.wait(5)
        self.hangs = False
        if self.trouble:
            raise self.trouble


SILENCE = DeviceTimeout("fake", "no answer", remedy="plug it in")


@pytest.fixture
def wire():
    return FakeTransport()


@pytest.fixture
def gripper(wire):
    with nothing_left():
        gripper = RobotiqGripper("fake", GripperOptions(stale_after_ms=150.0, poll_hz=150.0), wire, CLOCK)
        gripper.connect()
        gripper.arm()
        yield gripper
        wire.trouble = wire.open_trouble = None
        wire.gate.set()
        gripper.close()


def reports_an_aperture(gripper):
    try:
        return gripper.read().aperture_m > 0
    except StaleData:
        return False


def positions(wire):
    return [motion.position for _, motion in wire.writes if motion is not None]


def test_a_command_that_expires_in_the_mailbox_is_not_sent_and_is_counted(wire, gripper):
    wire.hold()
    gripper.command(to(0.01, within_s=0.02))
    CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.05))
    wire.gate.set()
    assert until(lambda: gripper.counts.expired == 1)
    assert positions(wire) == []


def test_the_newest_command_wins(wire, gripper):
    wire.hold()
    for mm in (30, 20, 10):
        gripper.command(to(mm * 1e-3, within_s=5))
    wire.gate.set()
    assert until(lambda: len(positions(wire)) == 1)
    assert positions(wire) == [183]
    assert gripper.counts.replaced == 2


def test_after_a_failure_the_gripper_is_looked_at_before_anything_is_written(wire, gripper):
    """A gripper that was switched off and on would take the command's rACT for an activation, and open."""
    wire.trouble = SILENCE
    assert until(lambda: gripper.counts.timeouts > 0)
    gripper.command(to(0.01, within_s=5))
    wire.status = Status(False, False, Activation.RESET, Detection.MOVING, 0, 0, 0, 138, 0)
    wire.trouble = None
    assert until(lambda: gripper.counts.refused == 1)
    gripper.stop()
    assert all(action == 0 for action, _ in wire.writes)
    with pytest.raises(DeviceFault, match=r"lost its activation.*arm\(\) again"):
        gripper.read()
    with pytest.raises(DeviceFault):
        gripper.command(to(0.02))


def test_a_command_survives_a_lost_frame_while_it_lives(wire, gripper):
    wire.trouble = SILENCE
    gripper.command(to(0.01, within_s=5))
    assert until(lambda: gripper.counts.timeouts > 1)
    wire.trouble = None
    assert until(lambda: positions(wire) == [183])


def test_errors_while_the_gripper_does_not_answer(wire, gripper):
    wire.trouble = SILENCE

    def stale():
        try:
            gripper.read()
        except StaleData as error:
            return isinstance(error.__cause__, DeviceTimeout) and "plug it in" in str(error)
        return False

    assert until(stale)
    with pytest.raises(StaleData):
        gripper.command(to(0.02))
    wire.trouble = None
    assert until(lambda: not stale())
    assert gripper.read().aperture_m == pytest.approx(0.02)


def test_stop_in_an_outage_returns_and_is_carried_out_later(wire, gripper):
    wire.trouble = SILENCE
    began = CLOCK.now()
    gripper.stop()
    assert CLOCK.now() - began < 1.5e9
    wire.trouble = None
    assert until(lambda: wire.writes == [(1, None)])


def test_stop_comes_before_a_command_that_waits(wire, gripper):
    wire.hold()
    gripper.command(to(0.05, within_s=5))
    thread = threading.Thread(target=gripper.stop)
    thread.start()
    CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.05))
    wire.gate.set()
    thread.join(5)
    CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.1))
    assert wire.writes == [(1, None)], "the command that waited was sent after the stop"


def test_stop_ends_an_activation_by_a_reset(wire):
    gripper = RobotiqGripper("fake", GripperOptions(keep_activation=False), wire, CLOCK)
    gripper.connect()
    failures = []

    def arm():
        try:
            gripper.arm()
        except DeviceFault as error:
            failures.append(error)

    thread = threading.Thread(target=arm)
    thread.start()
    assert until(lambda: wire.writes == [(0, None)])
    wire.status = REST._replace(activated=False, activation=Activation.RESET)
    assert until(lambda: (1, None) in wire.writes)
    wire.status = REST._replace(activation=Activation.ACTIVATING)
    gripper.stop()
    thread.join(5)
    assert wire.writes[-1] == (0, None)
    assert "stop() interrupted" in str(failures[0])
    assert gripper.lifecycle.value == "connected"
    gripper.close()


def test_stop_right_after_a_reset_does_not_activate(wire):
    """The newest status is still that of before the reset; to write its "activate" back would close and open."""
    gripper = RobotiqGripper("fake", GripperOptions(keep_activation=False), wire, CLOCK)
    gripper.connect()
    write = wire.write

    def resets(action, motion):
        write(action, motion)
        wire.status = Status(False, False, Activation.RESET, Detection.MOVING, 0, 0, 0, 138, 0)
        wire.write = write
        wire.gate.clear()

    wire.write = resets

    def arm():
        with contextlib.suppress(DeviceFault):
            gripper.arm()

    threads = [threading.Thread(target=arm)]
    threads[0].start()
    assert until(lambda: wire.writes == [(0, None)])
    threads.append(threading.Thread(target=gripper.stop))
    threads[1].start()
    assert until(lambda: wire.hangs)
    wire.gate.set()
    for thread in threads:
        thread.join(5)
    assert all(action == 0 for action, _ in wire.writes)
    gripper.close()


def test_close_ends_an_activation_too(wire):
    gripper = RobotiqGripper("fake", GripperOptions(keep_activation=False), wire, CLOCK)
    gripper.connect()
    failures = []

    def arm():
        try:
            gripper.arm()
        except (DeviceFault, LifecycleError) as error:
            failures.append(error)

    thread = threading.Thread(target=arm)
    thread.start()
    assert until(lambda: wire.writes == [(0, None)])
    gripper.close()
    thread.join(5)
    assert failures
    assert not wire.is_open


def test_registers_that_stand_still_are_noticed(wire, gripper):
    gripper.command(to(0.01))
    assert until(lambda: positions(wire) == [183])
    wire.status = REST

    def failed():
        try:
            gripper.read()
        except StaleData as error:
            return "stand still" in str(error)
        return False

    assert until(failed)


@pytest.mark.parametrize("code", [0x05, 0x09])
def test_faults_that_do_not_keep_it_from_obeying(wire, gripper, code):
    wire.status = REST._replace(fault=code)
    CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.05))
    gripper.command(to(0.01))
    assert until(lambda: positions(wire) == [183])
    gripper.read()


@pytest.mark.parametrize("code", [0x07, 0x08, 0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F, 0x03])
def test_faults_that_do(wire, gripper, code):
    wire.status = REST._replace(fault=code)

    def fault():
        try:
            gripper.read()
        except DeviceFault as error:
            return error
        return None

    assert until(fault)
    assert fault().code == f"0x{code:02X}"
    assert fault().remedy
    with pytest.raises(DeviceFault):
        gripper.command(to(0.01))


def test_a_lost_port_is_reopened_and_nothing_is_written(wire, gripper):
    lost = ConnectFailed("fake", "gone", remedy="plug it in")
    wire.trouble = wire.open_trouble = lost
    assert until(lambda: not wire.is_open)
    wire.trouble = wire.open_trouble = None
    assert until(lambda: gripper.counts.reconnects >= 1 and wire.is_open)
    assert until(lambda: reports_an_aperture(gripper))
    assert wire.writes == []


def test_silence_reopens_the_port(wire):
    gripper = RobotiqGripper("fake", GripperOptions(reconnect_after_s=0.1), wire, CLOCK)
    gripper.connect()
    wire.trouble = ProtocolFault("fake", "rubbish")
    assert until(lambda: gripper.counts.reconnects >= 1)
    assert gripper.counts.damaged > 0
    gripper.close()


def test_at_most_two_hundred_requests_a_second(wire, gripper):
    before, began = gripper.counts.requests, CLOCK.now()
    while CLOCK.now() - began < 0.3e9:
        gripper.command(to(0.01 + 0.01 * ((CLOCK.now() // 1000) % 100) / 100))
        CLOCK.sleep_until(CLOCK.now() + 500_000)
    seconds = (CLOCK.now() - began) * 1e-9
    assert gripper.counts.requests - before <= 200 * seconds + 2
    assert gripper.read().seq > 0, "a flood of commands does not keep the status from being read"


def test_automatic_release_is_sent_only_where_it_is_asked_for(wire, gripper):
    gripper.automatic_release(opening=False)
    assert wire.writes == [(0x11, None)]
    gripper.automatic_release()
    assert wire.writes[-1] == (0x31, None)
    gripper.disarm()
    with pytest.raises(LifecycleError):
        gripper.automatic_release()


# -- registers that stand still -------------------------------------------------------------------------------


class Lively(FakeTransport):
    """A gripper whose status shows the go-to bit, as long as its registers are refreshed."""

    def __init__(self):
        super().__init__()
        self.frozen = False

    def write(self, action, motion):
        self._ask()
        self.writes.append((action, motion))
        if not self.frozen:
            echo = self.status.echo if motion is None else motion.position
            self.status = self.status._replace(echo=echo, going=bool(action & GO_TO))


@pytest.fixture
def lively():
    wire = Lively()
    with nothing_left():
        options = GripperOptions(stale_after_ms=150.0, poll_hz=150.0, life_check_s=0.1)
        gripper = RobotiqGripper("fake", options, wire, CLOCK)
        gripper.connect()
        gripper.arm()
        yield wire, gripper
        wire.trouble = wire.open_trouble = None
        gripper.close()


def is_stale(gripper):
    try:
        gripper.read()
    except StaleData:
        return True
    return False


def stands_still(gripper):
    try:
        gripper.read()
    except StaleData as error:
        return "stand still" in str(error)
    return False


def test_a_stream_of_commands_does_not_hide_registers_that_stand_still(lively):
    wire, gripper = lively
    wire.frozen = True
    began = CLOCK.now()
    for mm in range(60, 20, -1):
        gripper.command(to(0.5e-3 * mm))
        CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.01))
        if stands_still(gripper):
            break
    assert stands_still(gripper)
    assert CLOCK.now() - began < nanoseconds(0.35)


def test_a_gripper_at_rest_is_tested_without_a_reader_noticing(lively):
    wire, gripper = lively
    gripper.command(to(0.01))
    states = []

    def tested():
        states.append(gripper.read())
        return len(wire.writes) >= 7

    assert until(tested)
    assert positions(wire) == [183]
    assert {action for action, motion in wire.writes if motion is None} == {ACTIVATE, ACTIVATE | GO_TO}
    at_rest = [state for state in states if state.target_m < 0.011]
    assert at_rest
    assert not any(state.moving for state in at_rest)


def test_a_gripper_that_freezes_at_rest_is_noticed(lively):
    wire, gripper = lively
    gripper.command(to(0.01))
    assert until(lambda: gripper.read().target_m < 0.011)
    wire.frozen = True
    assert until(lambda: stands_still(gripper), 2)


def test_a_gripper_that_freezes_while_it_moves_is_noticed_and_one_that_moves_slowly_is_not(lively):
    wire, gripper = lively
    gripper.command(to(0.01))
    assert until(lambda: gripper.read().target_m < 0.011)
    wire.status = wire.status._replace(detection=Detection.MOVING, going=True)
    assert until(lambda: gripper.read().moving)
    began = CLOCK.now()
    while CLOCK.now() - began < nanoseconds(0.8):
        wire.status = wire.status._replace(position=wire.status.position + 1)
        assert not stands_still(gripper)
        CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.1))
    wire.frozen = True
    assert until(lambda: stands_still(gripper), 2)


def test_a_late_answer_gets_the_time_of_its_request(lively):
    wire, gripper = lively
    assert until(lambda: gripper.read().seq > 5)
    wire.answer_s = 0.2
    # A state of half the exchange's time would be fresh.
    assert until(lambda: is_stale(gripper))
    began = CLOCK.now()
    while CLOCK.now() - began < nanoseconds(0.5):
        assert is_stale(gripper)
        CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.01))


def test_a_gripper_that_freezes_while_one_position_is_requested_again_and_again_is_noticed(lively):
    wire, gripper = lively
    gripper.command(to(0.01))
    assert until(lambda: gripper.read().target_m < 0.011)
    wire.frozen = True

    def noticed():
        # As often as a camera's frames come.
        gripper.command(to(0.01))
        CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.03))
        return stands_still(gripper)

    assert until(noticed, 2)


def test_the_bit_is_set_again_after_a_failure_in_the_middle_of_the_test(lively):
    wire, gripper = lively
    gripper.command(to(0.01))
    assert until(lambda: wire.writes and wire.writes[-1][1] is None)
    wire.trouble = SILENCE
    CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.05))
    wire.trouble = None
    assert until(lambda: wire.status.going)


def test_the_bit_is_set_again_when_the_clearing_was_carried_out_but_not_acknowledged(lively):
    wire, gripper = lively
    write = wire.write

    def losing(action, motion):
        write(action, motion)
        if action == ACTIVATE:
            wire.write = write
            raise SILENCE

    gripper.command(to(0.01))
    assert until(lambda: gripper.read().target_m < 0.011)
    wire.write = losing
    assert until(lambda: not wire.status.going)
    assert until(lambda: wire.status.going)


def test_a_gripper_that_has_lost_its_activation_is_not_activated_by_the_test(lively):
    wire, gripper = lively
    gripper.command(to(0.01))
    assert until(lambda: wire.writes and wire.writes[-1][1] is None)
    wire.status = wire.status._replace(activated=False, activation=Activation.RESET, going=False)
    written = len(wire.writes)
    CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.3))
    assert len(wire.writes) <= written + 1


def test_a_stop_in_the_middle_of_the_test_holds(lively):
    wire, gripper = lively
    gripper.command(to(0.01))
    assert until(lambda: wire.writes and wire.writes[-1][1] is None)
    gripper.stop()
    CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.3))
    assert not wire.status.going
