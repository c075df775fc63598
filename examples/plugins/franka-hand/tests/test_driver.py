"""The driver on a fake hand: interruption, limits, one clear error per failure, and a grip that no failure opens."""

from __future__ import annotations

import sys
import time
from types import SimpleNamespace

import pytest
from lsds.clock import WallClock
from lsds.contracts import BuildContext, Contact, GripperCommand
from lsds.errors import ConnectFailed, DeviceError, DeviceFault, StaleData
from lsds.registry import PluginHost

from conftest import Cell, send, wait
from lsds_franka_hand import hand as hand_module
from lsds_franka_hand.fake import FakeHand
from lsds_franka_hand.gripper import FrankaHand

on_object = pytest.mark.parametrize("cell", [60.0], indirect=True)
"""Runs a test with an object of 60 mm between the fingers."""


def error_of(gripper: FrankaHand, timeout_s: float = 3.0) -> DeviceError:
    """Return the first error of `read`."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        try:
            gripper.read()
        except DeviceError as error:
            return error
        time.sleep(0.01)
    raise AssertionError("no error")


def holding(cell: Cell, **options: float) -> FrankaHand:
    """Return a driver whose hand holds the object of 60 mm with 30 N."""
    gripper = cell.armed(**options)
    send(gripper, 0.05)
    wait(lambda: gripper.read().contact is Contact.CLOSING)
    return gripper


def under_way(cell: Cell, gripper: FrankaHand, target_m: float = 0.0) -> None:
    """Start a slow closing, and wait until the fingers move."""
    start_m = cell.fingers.width_m
    send(gripper, target_m, speed_m_s=0.02)
    wait(lambda: cell.fingers.width_m < start_m - 0.002)


def stopped_after_s(cell: Cell) -> float:
    """Return the time until the command that runs has ended."""
    began_s = time.monotonic()
    wait(lambda: not cell.fingers.running)
    return time.monotonic() - began_s


# -- what it does ---------------------------------------------------------------------------------------------


@on_object
def test_it_closes_with_a_force_and_opens_to_a_width(cell: Cell) -> None:
    gripper = holding(cell)
    state = gripper.read()
    assert state.aperture_m == pytest.approx(0.06)
    assert (state.target_m, state.moving) == (0.05, False)
    assert cell.fingers.force_n == 30.0
    send(gripper, 0.075)
    wait(lambda: gripper.read().aperture_m == pytest.approx(0.075))
    assert cell.fingers.commands == [("grasp", 0.05), ("move", 0.075)]
    wait(lambda: not gripper.read().moving)
    assert gripper.read().contact is Contact.NONE


def test_fingers_that_close_without_an_object_report_no_contact(cell: Cell) -> None:
    gripper = cell.armed()
    contacts = set()
    for target_m in (0.07, 0.065, 0.06):
        send(gripper, target_m)
        for _ in range(20):
            contacts.add(gripper.read().contact)
            time.sleep(0.01)
    assert cell.fingers.width_m == pytest.approx(0.06)
    assert cell.fingers.grasped
    assert contacts == {Contact.NONE}


def test_commands_stay_within_the_limits(cell: Cell) -> None:
    gripper = cell.armed()
    sent = send(gripper, -1.0, speed_m_s=9.0, force_n=900.0)
    assert (sent.aperture_m, sent.speed_m_s, sent.force_n) == (0.0, 0.1, 70.0)
    sent = send(gripper, 1.0, speed_m_s=0.0, force_n=0.0)
    assert (sent.aperture_m, sent.speed_m_s, sent.force_n) == (0.08, 0.02, 30.0)
    cell.fingers.max_width_m = 0.0771
    time.sleep(0.15)
    assert send(gripper, 1.0).aperture_m == pytest.approx(0.0771)


def test_a_newer_command_interrupts_within_50_ms(cell: Cell) -> None:
    gripper = cell.armed()
    took_s = []
    for _ in range(3):
        under_way(cell, gripper)
        send(gripper, 0.08)
        took_s.append(stopped_after_s(cell))
        wait(lambda: cell.fingers.width_m == pytest.approx(0.08))
        wait(lambda: not gripper.read().moving)
    # Other work on the machine may delay one of them.
    assert min(took_s) < 0.05


def test_a_stop_interrupts_within_50_ms(cell: Cell) -> None:
    gripper = cell.armed()
    took_s = []
    for _ in range(3):
        under_way(cell, gripper)
        gripper.stop()
        took_s.append(stopped_after_s(cell))
        stopped_m = cell.fingers.width_m
        time.sleep(0.2)
        assert cell.fingers.width_m == stopped_m > 0.01
        wait(lambda: not gripper.read().moving)
    assert min(took_s) < 0.05


def test_a_closing_that_should_end_earlier_does_not_pass_its_target(cell: Cell) -> None:
    gripper = cell.armed()
    under_way(cell, gripper)
    send(gripper, 0.07, speed_m_s=0.02)
    wait(lambda: gripper.read().aperture_m == pytest.approx(0.07))
    time.sleep(0.2)
    assert cell.fingers.width_m == pytest.approx(0.07)


def test_small_steps_at_25_hz_follow_without_a_stop(cell: Cell) -> None:
    gripper = cell.armed()
    widths = []
    for step in range(1, 41):
        send(gripper, 0.08 - step * 5e-4)
        time.sleep(0.04)
        widths.append(cell.fingers.width_m)
    assert widths == sorted(widths, reverse=True)
    # Each motion waits for a state that is newer than the last one, so the fingers lag by a few steps.
    assert max(width - (0.08 - step * 5e-4) for step, width in enumerate(widths, 1)) < 0.005
    wait(lambda: gripper.read().aperture_m == pytest.approx(0.06))
    assert cell.fingers.stops == 0
    assert {call for call, _ in cell.fingers.commands} == {"grasp"}


@on_object
def test_small_steps_onto_an_object_keep_one_grasp(cell: Cell) -> None:
    gripper = cell.armed()
    for step in range(1, 41):
        send(gripper, 0.065 - step * 5e-4)
        time.sleep(0.04)
    assert gripper.read().contact is Contact.CLOSING
    assert (cell.fingers.force_n, cell.fingers.stops) == (30.0, 0)
    into = [width for call, width in cell.fingers.commands if width < 0.06]
    assert len(into) == 1, "a grasp of an object that is held may fail"
    send(gripper, 0.045, force_n=50.0)
    wait(lambda: cell.fingers.force_n == 50.0)


# -- a grip that nothing opens --------------------------------------------------------------------------------


@on_object
@pytest.mark.parametrize("call", ["stop", "disarm", "close"])
def test_no_stop_takes_the_pressure_off_a_held_object(cell: Cell, call: str) -> None:
    gripper = holding(cell)
    getattr(gripper, call)()
    time.sleep(0.3)
    assert (cell.fingers.grasped, cell.fingers.force_n, cell.fingers.stops) == (True, 30.0, 0)


@on_object
def test_no_stop_takes_the_pressure_off_while_the_grasp_still_runs(cell: Cell) -> None:
    cell.fingers.lingers_s = 1.0
    gripper = cell.armed()
    send(gripper, 0.05)
    wait(lambda: cell.fingers.grasped)
    # Two states show that the fingers rest.
    time.sleep(0.2)
    gripper.stop()
    time.sleep(0.2)
    assert cell.fingers.running
    assert (cell.fingers.grasped, cell.fingers.force_n, cell.fingers.stops) == (True, 30.0, 0)
    send(gripper, 0.08)
    wait(lambda: cell.fingers.width_m == pytest.approx(0.08), 1.0)
    assert cell.fingers.stops == 1


@on_object
@pytest.mark.parametrize("fault", ["fails", "lost", "silent"])
def test_nothing_opens_because_a_message_failed(cell: Cell, fault: str) -> None:
    gripper = holding(cell, stale_after_ms=200.0)
    setattr(cell.fingers, fault, True)
    send(gripper, 0.04, force_n=50.0)
    error_of(gripper)
    with pytest.raises((StaleData, DeviceFault)):
        send(gripper, 0.08)
    gripper.stop()
    gripper.disarm()
    setattr(cell.fingers, fault, False)
    time.sleep(0.8)
    assert cell.fingers.grasped
    assert cell.fingers.width_m == pytest.approx(0.06)
    assert all(call == "grasp" for call, _ in cell.fingers.commands)


# -- what fails -----------------------------------------------------------------------------------------------


def test_a_failed_command_is_a_fault_until_the_gripper_is_armed_again(cell: Cell) -> None:
    gripper = cell.armed()
    cell.fingers.fails = True
    send(gripper, 0.05)
    error = error_of(gripper)
    assert isinstance(error, DeviceFault)
    assert "the motion to 50.0 mm failed: command rejected (check the fingers, then disarm and arm" in str(error)
    with pytest.raises(DeviceFault):
        send(gripper, 0.08)
    cell.fingers.fails = False
    assert cell.fingers.commands == []
    gripper.disarm()
    gripper.arm()
    send(gripper, 0.07)
    wait(lambda: gripper.read().aperture_m == pytest.approx(0.07))


def test_a_failure_drops_what_was_due(cell: Cell) -> None:
    gripper = cell.armed()
    under_way(cell, gripper, 0.04)
    send(gripper, 0.02, speed_m_s=0.02)
    cell.fingers.lost = True
    wait(lambda: not cell.fingers.running)
    cell.fingers.lost = False
    time.sleep(0.8)
    assert cell.fingers.commands == [("grasp", 0.04)]


def test_a_stop_without_effect_drops_what_was_due(cell: Cell) -> None:
    gripper = cell.armed(interrupt_limit_s=0.2)
    under_way(cell, gripper, 0.065)
    cell.fingers.stop_works = False
    send(gripper, 0.08)
    wait(lambda: not cell.fingers.running)
    time.sleep(0.3)
    assert cell.fingers.commands == [("grasp", 0.065)]


def test_a_move_without_success_is_a_fault(cell: Cell, monkeypatch: pytest.MonkeyPatch) -> None:
    gripper = cell.armed()
    send(gripper, 0.07)
    wait(lambda: cell.fingers.width_m == pytest.approx(0.07))
    monkeypatch.setattr(FakeHand, "move", lambda self, width, speed: False)
    send(gripper, 0.08)
    assert "the motion to 80.0 mm failed: the hand reports no success" in str(error_of(gripper))


def test_a_command_that_does_not_end_is_a_fault_and_is_stopped_again(cell: Cell) -> None:
    gripper = cell.armed(interrupt_limit_s=0.3)
    under_way(cell, gripper)
    cell.fingers.stop_works = False
    gripper.stop()
    error = error_of(gripper)
    assert "a command has not ended 0.3 s after it was stopped (use the emergency stop" in str(error)
    assert cell.fingers.stops > 1
    cell.fingers.stop_works = True
    wait(lambda: not cell.fingers.running, 0.3)


def test_a_motion_that_is_due_too_late_is_not_started(cell: Cell) -> None:
    gripper = cell.armed(interrupt_limit_s=5.0)
    cell.fingers.stop_works = False
    under_way(cell, gripper, 0.07)
    gripper.command(GripperCommand(0.08, 0.1, 30.0, time.monotonic_ns() + 100_000_000))
    wait(lambda: not cell.fingers.running)
    time.sleep(0.2)
    assert cell.fingers.width_m == pytest.approx(0.07)
    assert cell.fingers.commands == [("grasp", 0.07)]
    assert not gripper.read().moving


def test_a_state_that_is_too_old_is_stale_until_the_next_one(cell: Cell) -> None:
    gripper = cell.armed(stale_after_ms=200.0)
    cell.fingers.silent = True
    error = error_of(gripper)
    assert isinstance(error, StaleData)
    assert "no state for 200 ms (check the robot and its network)" in str(error)
    with pytest.raises(StaleData):
        send(gripper, 0.05)
    cell.fingers.silent = False
    time.sleep(0.2)
    gripper.read()
    assert cell.fingers.commands == []


def test_a_lost_hand_is_stale_with_its_cause_and_comes_back(cell: Cell) -> None:
    gripper = cell.armed(stale_after_ms=200.0)
    cell.fingers.lost = True
    error = error_of(gripper)
    assert isinstance(error, StaleData)
    assert "connection lost" in str(error)
    with pytest.raises(ConnectFailed, match=r"no connection to the hand: connection lost \(check the address"):
        cell.driver().connect()
    cell.fingers.lost = False
    time.sleep(0.8)
    send(gripper, 0.07)
    wait(lambda: gripper.read().aperture_m == pytest.approx(0.07))


def test_a_width_that_the_hand_cannot_have_is_refused(cell: Cell) -> None:
    cell.fingers.place(0.12)
    with pytest.raises(ConnectFailed, match=r"a width of 120\.0 mm \(home the hand"):
        cell.driver().connect()


# -- homing ---------------------------------------------------------------------------------------------------


def test_a_hand_that_was_not_homed_moves_only_if_the_rig_allows_it(cell: Cell) -> None:
    cell.fingers.max_width_m = 0.0
    gripper = cell.driver()
    gripper.connect()
    with pytest.raises(DeviceFault, match=r"has not been homed \(home it in Desk, or set home = true"):
        gripper.arm()
    assert cell.fingers.commands == []
    gripper.close()
    gripper = cell.armed(home=True)
    assert cell.fingers.commands == [("homing", 0.08)]
    send(gripper, 0.07)
    wait(lambda: gripper.read().aperture_m == pytest.approx(0.07))


def test_a_hand_that_forgets_its_width_is_not_closed_by_a_command(cell: Cell) -> None:
    gripper = cell.armed()
    cell.fingers.max_width_m = 0.0
    time.sleep(0.15)
    with pytest.raises(DeviceFault, match="has not been homed"):
        send(gripper, 0.08)
    assert cell.fingers.commands == []


def test_a_homing_that_finds_no_width_is_a_fault(cell: Cell, monkeypatch: pytest.MonkeyPatch) -> None:
    cell.fingers.max_width_m = 0.0
    monkeypatch.setattr(FakeHand, "homing", lambda self: True)
    gripper = cell.driver(home=True)
    gripper.connect()
    with pytest.raises(DeviceFault, match="has not been homed"):
        gripper.arm()


def test_homing_never_opens_a_hand_that_holds_something(cell: Cell) -> None:
    cell.fingers.max_width_m, cell.fingers.grasped = 0.0, True
    gripper = cell.driver(home=True)
    gripper.connect()
    with pytest.raises(DeviceFault, match="holds an object"):
        gripper.arm()
    assert cell.fingers.commands == []


# -- libfranka ------------------------------------------------------------------------------------------------


def real() -> FrankaHand:
    """Return the driver of a real hand."""
    built: FrankaHand = PluginHost().build("gripper", "franka-hand", {"host": "10.0.0.2"}, BuildContext(WallClock()))
    return built


def test_without_the_library_the_error_names_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "panda_py.libfranka", None)
    with pytest.raises(ConnectFailed, match=r"panda_py is not installed.* \(pip install panda-python, in the version"):
        real().connect()


def test_bindings_that_block_all_threads_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "panda_py.libfranka", None)
    monkeypatch.setattr(hand_module, "has_module", lambda name: name == "pylibfranka")
    with pytest.raises(ConnectFailed, match="pylibfranka lets no other thread run during a command"):
        real().connect()


def test_the_library_is_opened_at_the_host(cell: Cell, monkeypatch: pytest.MonkeyPatch) -> None:
    hosts = []

    def opened(host: str) -> FakeHand:
        hosts.append(host)
        return FakeHand(cell.fingers)

    monkeypatch.setitem(sys.modules, "panda_py", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "panda_py.libfranka", SimpleNamespace(Gripper=opened))
    gripper = real()
    cell.grippers.append(gripper)
    gripper.connect()
    assert hosts == ["10.0.0.2"]
    assert gripper.read().aperture_m == pytest.approx(0.08)
