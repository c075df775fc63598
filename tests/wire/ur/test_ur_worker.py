"""The child that holds ur_rtde feeds the controller's watchdog only while it has the arm in hand, and ends else."""

from __future__ import annotations

import math
import socket
import time

import pytest
from lsds_drivers.ur.options import UrOptions
from lsds_drivers.ur.packets import Command, Kind, pack_command
from lsds_drivers.ur.worker import RESEND_NS, Lost, Worker

SPEED = 0.03
HUNGRY_S = 1 / UrOptions().watchdog_hz
STILL, RUNS = (0.0,) * 6, (0.0, 0.0, SPEED, 0.0, 0.0, 0.0)
SETTLED_S = 0.8
"""Longer than the child waits for anything, by these options."""


class Controller:
    """ur_rtde's two interfaces: `answers` gives what a call returns, raises, or does; default True."""

    def __init__(self, answers):
        self.answers, self.calls = {"getRuntimeState": 2, "getSafetyStatusBits": 1, **answers}, []

    def __getattr__(self, name):
        def call(*arguments):
            self.calls.append((name, time.monotonic()))
            answer = self.answers.get(name, True)
            answer = answer(*arguments) if callable(answer) else answer
            if isinstance(answer, Exception):
                raise answer
            return answer

        return call

    def count(self, name):
        return sum(called == name for called, _ in self.calls)

    def hungry_s(self):
        """How long the watchdog has had nothing."""
        return time.monotonic() - max(at for called, at in self.calls if called in ("kickWatchdog", "speedL"))


class Arm:
    """A worker with such a controller, in control; `speed` is that of the states, None for no states."""

    def __init__(self, answers):
        self.link, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.controller, self.speed, self.every_ns = Controller(answers), STILL, 0
        self.worker = Worker(theirs, UrOptions().model_dump())
        self.worker._receive = self.worker._control = self.controller

    def command(self, within_s=0.1, speed=SPEED):
        expires_ns = time.monotonic_ns() + round(within_s * 1e9)
        self.link.send(pack_command(Command((0.0, 0.0, speed, 0.0, 0.0, 0.0), 1.0, expires_ns)))

    def stop(self):
        self.link.send(bytes([Kind.STOP]))

    def serve(self, for_s):
        ends = time.monotonic() + for_s
        while time.monotonic() < ends:
            if self.speed is not None and time.monotonic_ns() - self.worker._seen.judged_ns >= self.every_ns:
                self.worker._runtime(self.controller.answers["getRuntimeState"])
                self.worker._seen.judge(self.speed, time.monotonic_ns())
            self.worker._listen()
            self.worker._drive()

    def moves_and_rests(self, for_s):
        self.command()
        self.speed = RUNS
        self.serve(for_s)
        self.speed = STILL
        self.serve(SETTLED_S)


@pytest.fixture
def arm(request):
    arm = Arm(getattr(request, "param", {}))
    yield arm
    arm.link.close()
    arm.worker._link.close()


def test_at_rest_the_watchdog_is_fed_before_and_after_a_motion(arm):
    arm.serve(0.1)
    assert arm.controller.count("kickWatchdog")
    for _ in range(2):
        arm.moves_and_rests(0.12)
    assert arm.controller.count("speedStop") == 2
    assert arm.controller.hungry_s() < HUNGRY_S


def moves_only(twist, acceleration, duration):
    """A controller that takes motions and no stops."""
    return any(twist)


def refusing(error):
    def call(*arguments):
        raise error

    return call


@pytest.mark.parametrize(
    "arm",
    [{"speedL": moves_only}, {"speedStop": False}, {"speedStop": refusing(RuntimeError("no answer"))}],
    ids=["speedL", "speedStop", "speedStop raises"],
    indirect=True,
)
@pytest.mark.parametrize("ended", ["expiry", "stop"])
def test_a_stop_that_the_controller_does_not_take_ends_the_child(arm, ended):
    arm.command(within_s=0.1 if ended == "expiry" else 30)
    arm.serve(0.05)
    if ended == "stop":
        arm.stop()
    with pytest.raises(Lost, match="refused a motion or a stop"):
        arm.serve(SETTLED_S)
    assert arm.controller.hungry_s() > HUNGRY_S, "fed while the arm's motion was unknown"


@pytest.mark.parametrize("arm", [{"speedL": moves_only}], indirect=True)
def test_every_further_stop_is_tried_too_and_no_command_gets_through(arm):
    arm.command(within_s=30)
    arm.serve(0.05)
    moved = arm.controller.count("speedL")
    for _ in range(3):
        arm.stop()
    arm.serve(0.02)
    assert arm.controller.count("speedL") == moved + 3
    arm.command(within_s=30)
    arm.serve(0.1)
    assert arm.controller.count("speedL") == moved + 3


@pytest.mark.parametrize("arm", [{"speedL": False}], indirect=True)
def test_a_motion_that_cannot_be_renewed_ends_the_child(arm):
    arm.command(within_s=30)
    with pytest.raises(Lost, match="refused a motion or a stop"):
        arm.serve(SETTLED_S)
    assert arm.controller.count("speedL") == 1


@pytest.mark.parametrize("why", [{"getRuntimeState": 1}, {"getSafetyStatusBits": 4}], ids=repr)
def test_where_the_controller_has_stopped_it_the_child_stays_and_feeds_nothing(arm, why):
    arm.serve(0.05)
    arm.controller.answers |= {"speedL": False, **why}
    arm.command(within_s=30)
    arm.serve(SETTLED_S)
    assert arm.controller.hungry_s() > HUNGRY_S


def test_a_long_stop_is_watched_and_feeds_the_watchdog_all_the_way(arm):
    arm.command(within_s=30)
    arm.speed = RUNS
    arm.serve(0.1)
    arm.stop()
    for part in range(19, -1, -1):
        arm.speed = (0.0, 0.0, SPEED * part / 20, 0.0, 0.0, 0.0)
        arm.serve(0.05)
        assert arm.controller.hungry_s() < HUNGRY_S
    arm.serve(0.2)
    assert arm.controller.count("speedStop") == 1
    assert arm.controller.hungry_s() < HUNGRY_S


@pytest.mark.parametrize("seen", [RUNS, (0.0, 0.0, 0.0, 0.0, 0.0, 0.1), (0.0, math.nan, 0.0, 0.0, 0.0, 0.0)])
def test_an_arm_that_does_not_slow_down_is_lost(arm, seen):
    arm.serve(0.1)
    arm.command()
    arm.speed = seen
    with pytest.raises(Lost, match="does not slow down"):
        arm.serve(SETTLED_S)


def test_an_arm_that_is_not_seen_is_left_to_the_controller_s_watchdog(arm):
    arm.serve(0.1)
    arm.command()
    arm.speed = None
    arm.serve(SETTLED_S)
    assert arm.controller.hungry_s() > HUNGRY_S
    arm.speed = STILL
    arm.command()
    arm.serve(SETTLED_S)
    assert arm.controller.hungry_s() > HUNGRY_S, "until it is armed again"


def test_states_at_ten_hertz_are_enough(arm):
    arm.worker._options["state_rate_hz"], arm.every_ns = 10.0, 100_000_000
    for _ in range(2):
        arm.moves_and_rests(0.25)
    assert arm.controller.count("speedStop") == 2


def test_a_moment_of_rest_before_it_gets_going_is_no_rest(arm):
    arm.command(within_s=30)
    arm.serve(0.02)
    arm.stop()
    arm.serve(0.05)
    arm.speed = RUNS
    with pytest.raises(Lost):
        arm.serve(SETTLED_S)


def sluggish(*arguments):
    time.sleep(0.3)
    return True


@pytest.mark.parametrize("arm", [{"speedL": sluggish}], indirect=True)
def test_a_controller_that_takes_long_may_run_another_program_by_then(arm):
    arm.command()
    with pytest.raises(Lost, match="took too long"):
        arm.serve(SETTLED_S)


def test_a_program_reported_as_ended_is_commanded_to_stop_all_the_same(arm):
    arm.command(within_s=30)
    arm.speed = RUNS
    arm.serve(0.1)
    arm.controller.answers["getRuntimeState"] = 1
    arm.serve(0.05)
    arm.stop()
    arm.serve(0.05)
    name, _ = arm.controller.calls[-1]
    assert name == "speedL"


@pytest.mark.parametrize("slow", [0.004, 0.0025])
def test_slow_motions_are_seen_too_whatever_came_before(arm, slow):
    arm.command(within_s=30)
    arm.speed = (0.0, 0.0, 0.25, 0.0, 0.0, 0.0)
    arm.serve(0.1)
    arm.command()
    arm.speed = (0.0, 0.0, slow, 0.0, 0.0, 0.0)
    with pytest.raises(Lost, match="does not slow down"):
        arm.serve(SETTLED_S)


def test_an_arm_that_moves_with_no_command_long_after_its_stop_is_lost(arm):
    arm.command()
    arm.serve(SETTLED_S)
    arm.speed = RUNS
    arm.serve(0.1)
    sent = arm.controller.count("speedL")
    arm.stop()
    arm.serve(0.02)
    assert arm.controller.count("speedL") > sent, "a stop is always tried"
    with pytest.raises(Lost):
        arm.serve(SETTLED_S)


def test_unstopped_it_is_lost_just_so(arm):
    arm.serve(0.1)
    arm.speed = RUNS
    with pytest.raises(Lost, match="moves without a command"):
        arm.serve(SETTLED_S)


def test_once_the_program_has_ended_another_one_is_ignored(arm):
    arm.command()
    arm.serve(SETTLED_S)
    arm.controller.answers["getRuntimeState"] = 1
    arm.serve(0.05)
    arm.controller.answers["getRuntimeState"], arm.speed = 2, RUNS
    arm.command()
    arm.serve(SETTLED_S)
    assert arm.controller.hungry_s() > HUNGRY_S
    assert arm.worker._runtime(2) == 1, "the driver receives that it has ended"


def test_commands_in_a_row_may_move_for_as_long_as_they_like(arm):
    arm.speed = RUNS
    for _ in range(20):
        arm.command()
        arm.serve(0.05)
    assert arm.controller.count("speedStop") == 0
    assert arm.controller.count("speedL") >= 1e9 / RESEND_NS / 2


def test_without_its_watchdog_it_is_not_armed(arm, monkeypatch):
    monkeypatch.setattr(arm.worker, "_refusal", lambda: None)
    assert arm.worker._arm().problem == ""
    arm.controller.answers["setWatchdog"] = False
    assert "watchdog" in arm.worker._arm().problem
    assert arm.controller.count("stopScript") == 1


@pytest.mark.parametrize("arm", [{"speedStop": False}], indirect=True)
def test_disarmed_and_armed_again_it_takes_control_again_and_feeds_the_watchdog(arm, monkeypatch):
    arm.command()
    arm.serve(0.25)
    fresh = Controller({})
    monkeypatch.setattr(arm.worker, "_refusal", lambda: None)
    monkeypatch.setattr(arm.worker, "_new_control", lambda: fresh)
    arm.worker._disarm()
    assert arm.worker._arm().problem == ""
    assert arm.controller.count("stopScript") == 1
    arm.serve(0.05)
    assert fresh.count("kickWatchdog")
    arm.command()
    arm.serve(SETTLED_S)
    assert fresh.hungry_s() < HUNGRY_S
