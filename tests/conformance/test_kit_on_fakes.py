"""The kit passes a device that keeps the contract, and fails one that does not."""

from __future__ import annotations

import numpy as np
import pytest
from fake_cell import FakeArm, FakeGripper, FakePoses, FakeSensor, fake_host

from lsds.errors import LifecycleError
from lsds.testing import Bench, cases, conformance
from lsds.testing.lifecycle import (
    check_closed_is_final,
    check_constructing_does_no_io,
    check_stops_from_any_state_and_thread,
)
from lsds.testing.machine import check_any_order_of_calls
from lsds.testing.motion import (
    check_arm_rests_after_expiry,
    check_gripper_finishes_after_expiry,
    check_gripper_never_opens_on_failure,
    check_refuses_what_is_not_finite,
)
from lsds.testing.sensing import check_frames_are_as_declared, check_frames_are_not_overwritten

HOST = fake_host()


@conformance("sensor", "fake-sensor", host=HOST)
def test_sensor(check):
    check()


@conformance("gripper", "fake-gripper", host=HOST)
def test_gripper(check):
    check()


@conformance("arm", "fake-arm", host=HOST)
def test_arm(check):
    check()


@conformance("pose_source", "fake-poses", host=HOST)
def test_poses(check):
    check()


def fails(kind, name, check, match=None):
    with pytest.raises((AssertionError, pytest.fail.Exception, LifecycleError), match=match):
        check(Bench(kind, name, host=HOST))


def test_a_constructor_that_opens_something_is_found(monkeypatch):
    def opens(self, options, context, original=FakeGripper.__init__):
        original(self, options, context)
        with open("/dev/null"):
            pass

    monkeypatch.setattr(FakeGripper, "__init__", opens)
    fails("gripper", "fake-gripper", check_constructing_does_no_io, match="the constructor accessed")


def test_a_stop_that_raises_is_found(monkeypatch):
    monkeypatch.setattr(FakeArm, "stop", lambda self: self.guard.require_armed("stop"))
    fails("arm", "fake-arm", check_stops_from_any_state_and_thread, match="stop\\(\\) raised")


def test_a_gripper_that_opens_when_stopped_is_found(monkeypatch):
    def stop(self):
        self._start_m = self._target_m = self.spec.stroke_m

    monkeypatch.setattr(FakeGripper, "stop", stop)
    fails("gripper", "fake-gripper", check_gripper_never_opens_on_failure, match="opened from")


def test_a_gripper_that_halts_on_expiry_is_found(monkeypatch):
    original = FakeGripper._aperture

    def halting(self, now):
        return original(self, min(now, self._start_ns + 20_000_000))

    monkeypatch.setattr(FakeGripper, "_aperture", halting)
    fails("gripper", "fake-gripper", check_gripper_finishes_after_expiry)


def test_an_arm_that_runs_away_is_found(monkeypatch):
    def runaway(self):
        self._z += self._speed * (self.clock.now() - self._at_ns) / 1e9
        self._at_ns = self.clock.now()

    monkeypatch.setattr(FakeArm, "_advance", runaway)
    fails("arm", "fake-arm", check_arm_rests_after_expiry, match="still moving")


def test_a_gripper_that_takes_nan_is_found(monkeypatch):
    monkeypatch.setattr(FakeGripper, "command", lambda self, command: command)
    fails("gripper", "fake-gripper", check_refuses_what_is_not_finite, match="did not raise")


def test_a_read_after_close_is_found(monkeypatch):
    monkeypatch.setattr(FakePoses, "read", lambda self: None)
    fails("pose_source", "fake-poses", check_closed_is_final, match="did not raise")


def test_a_wrong_image_is_found(monkeypatch):
    original = FakeSensor.read

    def read(self):
        frame = original(self)
        return type(frame)(frame.image[..., 0], frame.t_ns, frame.seq)

    monkeypatch.setattr(FakeSensor, "read", read)
    fails("sensor", "fake-sensor", check_frames_are_as_declared)


def test_a_reused_buffer_is_found(monkeypatch):
    original = FakeSensor.read
    shared = np.zeros((12, 16, 3), np.uint8)

    def read(self):
        frame = original(self)
        shared[:] = frame.image
        return type(frame)(shared, frame.t_ns, frame.seq)

    monkeypatch.setattr(FakeSensor, "read", read)
    fails("sensor", "fake-sensor", check_frames_are_not_overwritten, match="changed a frame that it had returned")


def test_the_state_machine_finds_a_command_taken_too_early(monkeypatch):
    monkeypatch.setattr(FakeGripper, "command", lambda self, command: command)
    fails("gripper", "fake-gripper", check_any_order_of_calls)


def test_real_devices_are_not_moved_unasked():
    unasked = cases(Bench("gripper", "real-gripper", host=HOST))
    moving = [case for case in unasked if "gripper_never_opens" in case.id]
    with pytest.raises(pytest.skip.Exception, match="allow_motion"):
        moving[0]()


def test_expected_failures_have_to_exist():
    with pytest.raises(ValueError, match="do not exist"):
        conformance("gripper", "fake-gripper", host=HOST, expected_failures={"flies": "it cannot"})


def test_a_kind_without_checks_is_refused():
    with pytest.raises(ValueError, match="no conformance checks for a cell"):
        cases(Bench("cell", "fake-cell", host=HOST))


def test_algorithms_have_checks_of_their_own():
    names = {case.check.__name__ for case in cases(Bench("detector", "plain", host=HOST))}
    assert "check_detections_are_sound" in names
    assert "check_walks_through_its_life" not in names
