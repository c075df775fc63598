"""A call that hangs while the cell runs: it is named, the arm stops, the grip is kept, and the results are there."""

from __future__ import annotations

import threading

import pytest

import lsds
from lsds.errors import BringUpError, CallHangs, SafetyStop
from lsds.runtime.rig import Rig

pytestmark = pytest.mark.usefixtures("installed_host")
QUICK = ("cell.simulated.fidelity=winkler", "task.grip_aperture_m=0.0236", "task.lift_s=4.0")
# Generous enough for a busy machine, on which no call of a sound device takes so long.
LIMITS = ("deadlines.call_s=1.0", "deadlines.connect_s=1.0", "deadlines.close_s=1.0")
AT_S = 2.6
"""The arm lifts then."""


@pytest.fixture
def free():
    """Yield the event that hanging calls wait for; it is set at the end of the test."""
    free = threading.Event()
    yield free
    free.set()


def hang_from(rig, device, name, free, at_s=AT_S):
    call = getattr(device, name)

    def calling(*arguments):
        if rig.clock.now() >= at_s * 1e9:
            free.wait(60)
        return call(*arguments)

    setattr(device, name, calling)


PLACES = {
    "sensor": (lambda rig: rig.sensor, "read", "sensor 'mock-gelsight-mini' has not returned from read()"),
    "arm": (lambda rig: rig.arm, "command", "arm 'mock-ur5e' has not returned from command()"),
    "detector": (lambda rig: rig.detector, "update", "has not returned from update()"),
    "job": (lambda rig: rig.job, "step", "job 'lift' has not returned from step()"),
}


def whole(engine):
    engine.run()


def stepwise(engine):
    for _ in engine:
        pass


def beside(engine):
    with engine.background() as running:
        running.wait(60.0)


@pytest.mark.parametrize(
    ("place", "run", "clock"),
    [*((place, whole, "virtual") for place in PLACES), ("sensor", stepwise, "virtual"), ("sensor", beside, "wall")],
)
def test_whatever_hangs_the_arm_stops_and_the_grip_is_kept(place, run, clock, free):
    device, name, expected = PLACES[place]
    calls = []
    with lsds.bring_up(overrides=[*QUICK, *LIMITS, f"clock={clock}"]) as engine:
        rig = engine.rig
        hang_from(rig, device(rig), name, free, rig.clock.now() / 1e9 + AT_S)
        stop, command = rig.arm.stop, rig.gripper.command
        rig.arm.stop = lambda: (calls.append("arm.stop"), stop())[1]
        grips = []
        rig.gripper.command = lambda asked: (grips.append(asked.aperture_m), command(asked))[1]
        with pytest.raises(CallHangs) as caught:
            run(engine)
        assert expected in str(caught.value)
        assert "arm.stop" in calls
        sent = len(grips)
        free.set()  # The call returns after all: too late for it to send anything.
        rig.clock.sleep_until(rig.clock.now() + 500_000_000)
        assert len(grips) == sent
        assert max(grips[1:], default=0.0) <= grips[0]
        assert rig.arm.read().tcp_twist.linear_m_s == pytest.approx((0, 0, 0), abs=1e-6)


def test_a_device_that_hangs_in_connect_is_one_of_the_results(monkeypatch, free):
    from lsds_mocks.devices.hand_e import MockHandE

    monkeypatch.setattr(MockHandE, "connect", lambda self: free.wait(60))
    rig = Rig(lsds.load_config(None, [*QUICK, *LIMITS]))
    with pytest.raises(BringUpError) as caught, rig:
        pass
    message = str(caught.value)
    assert "1 of 3 devices failed to connect" in message
    assert "failed: CallHangs: has not returned from connect() for 1 s" in message
    assert rig.arm.lifecycle.value == "closed"


def test_a_device_that_hangs_in_close_loses_no_result(monkeypatch, free):
    from lsds_mocks.devices.hand_e import MockHandE

    monkeypatch.setattr(MockHandE, "close", lambda self: free.wait(60))
    early = []
    session = lsds.run(overrides=[*QUICK, *LIMITS, "task.lift_s=0.3", "task.hold_s=0.1"], finished=early.append)
    assert session.summary["outcome"] == early[0].summary["outcome"] == "held"
    assert early[0].fault is None
    (failure,) = session.fault.exceptions
    assert isinstance(failure, CallHangs)
    assert "gripper 'mock-hand-e' has not returned from close() for 1 s" in str(failure)


def test_an_observer_of_a_run_is_called_by_its_caller():
    threads = set()
    lsds.run(
        overrides=[*QUICK, "task.lift_s=0.1", "task.hold_s=0.1"],
        observe=lambda cycle: threads.add(threading.current_thread()),
    )
    assert threads == {threading.current_thread()}


def test_failures_after_the_watchdog_has_fired_are_attributed_to_it(free):
    """In real time: the sensor takes longer than the watchdog waits, and then fails in another way."""
    with lsds.bring_up(overrides=[*QUICK, "clock=wall", "safety.watchdog_s=0.2"]) as engine:
        read, slow = engine.rig.sensor.read, []

        def reading():
            frame = read()
            if engine.stage != "begin" and not slow:
                slow.append(free.wait(0.6))
                raise lsds.LsdsError("a consequence")
            return frame

        engine.rig.sensor.read = reading
        with pytest.raises(
            SafetyStop, match=r"watchdog: the loop was silent.*sensor 'mock-gelsight-mini'|machine is busy"
        ):
            engine.run()
