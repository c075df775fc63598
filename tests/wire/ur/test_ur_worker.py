"""The child that holds ur_rtde feeds the controller's watchdog only while it knows what the arm does."""

from __future__ import annotations

import socket
import time

import pytest
from lsds_drivers.ur.options import UrOptions
from lsds_drivers.ur.packets import Command, Kind, pack_command
from lsds_drivers.ur.worker import WATCHDOG_HZ, Worker

SETTLED_S = 1.2
"""Longer than any stop takes by these options."""


class Controller:
    """ur_rtde's two interfaces: `answers` tells what a call returns, or raises; True where it does not say."""

    def __init__(self, answers):
        self.answers, self.calls, self.speed = answers, [], [0.0] * 6

    def __getattr__(self, name):
        def call(*arguments):
            self.calls.append((name, time.monotonic()))
            answer = self.answers.get(name, True)
            if isinstance(answer, Exception):
                raise answer
            return answer

        return call

    def getActualTCPSpeed(self):
        return self.speed

    def last(self, name):
        return max(at for called, at in self.calls if called == name)


class Arm:
    """A worker around such a controller, in control, and the driver's end of its link."""

    def __init__(self, answers):
        self.link, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.controller = Controller(answers)
        self.worker = Worker(theirs, UrOptions().model_dump())
        self.worker._receive = self.worker._control = self.controller

    def command(self, within_s=0.1):
        expires_ns = time.monotonic_ns() + round(within_s * 1e9)
        self.link.send(pack_command(Command((0.0, 0.0, 0.03, 0.0, 0.0, 0.0), 1.0, expires_ns)))

    def serve(self, for_s):
        """Let the worker run, with a stream of states that tells its controller's speed."""
        ends = time.monotonic() + for_s
        while time.monotonic() < ends:
            self.worker._changed_ns = time.monotonic_ns()
            self.worker._listen()
            self.worker._drive()

    def starves(self):
        """Whether the watchdog has had nothing for longer than it waits, and gets nothing any more."""
        seen = len(self.controller.calls)
        self.serve(2 / WATCHDOG_HZ)
        return len(self.controller.calls) == seen


@pytest.fixture
def arm(request):
    arm = Arm(getattr(request, "param", {}))
    yield arm
    arm.link.close()
    arm.worker._link.close()


def test_at_rest_the_watchdog_is_fed_before_and_after_a_motion(arm):
    arm.serve(0.1)
    assert arm.controller.last("kickWatchdog")
    arm.command()
    arm.serve(SETTLED_S)
    assert [name for name, _ in arm.controller.calls].count("speedStop") == 1
    assert time.monotonic() - arm.controller.last("kickWatchdog") < 1 / WATCHDOG_HZ
    arm.command()
    arm.serve(0.05)
    arm.link.send(bytes([Kind.STOP]))
    arm.serve(0.1)
    assert [name for name, _ in arm.controller.calls].count("speedStop") == 2


REFUSALS = [False, RuntimeError("no answer")]


@pytest.mark.parametrize("arm", [{"speedStop": refusal} for refusal in REFUSALS], ids=repr, indirect=True)
@pytest.mark.parametrize("ended", ["expiry", "stop"])
def test_a_stop_that_the_controller_does_not_take_starves_its_watchdog(arm, ended):
    arm.command(within_s=0.1 if ended == "expiry" else 30)
    arm.serve(0.05)
    if ended == "stop":
        arm.link.send(bytes([Kind.STOP]))
    arm.serve(0.1)
    assert arm.starves(), arm.controller.calls[-1]
    arm.command(within_s=30)
    assert arm.starves(), "a new command feeds the watchdog of an arm that nobody has in hand"


@pytest.mark.parametrize("arm", [{"speedL": False}], indirect=True)
def test_a_motion_that_cannot_be_renewed_is_stopped(arm):
    arm.command(within_s=30)
    arm.serve(0.05)
    assert "speedStop" in {name for name, _ in arm.controller.calls}


def test_an_arm_that_says_it_stops_and_runs_on_starves_its_watchdog(arm):
    arm.command()
    arm.controller.speed = [0.0, 0.0, 0.03, 0.0, 0.0, 0.0]
    arm.serve(SETTLED_S)
    assert arm.starves()


@pytest.mark.parametrize("arm", [{"speedStop": False}], indirect=True)
def test_armed_again_it_takes_control_anew_and_feeds_the_watchdog(arm, monkeypatch):
    arm.command()
    arm.serve(0.2)
    assert arm.starves()
    fresh = Controller({})
    monkeypatch.setattr(arm.worker, "_refusal", lambda: None)
    monkeypatch.setattr(arm.worker, "_new_control", lambda: fresh)
    assert arm.worker._arm().problem == ""
    assert "stopScript" in {name for name, _ in arm.controller.calls}
    arm.serve(0.05)
    assert fresh.last("kickWatchdog")
