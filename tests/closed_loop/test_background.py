"""The engine in the background of a user's program, in real time: it holds, ends with it, and reports its errors."""

from __future__ import annotations

import gc
import threading

import cv2
import pytest

import lsds
from lsds.clock import WallClock
from lsds.errors import ConfigError, DataError, PluginError, SafetyStop

# In real time: where other work has taken the machine, a test is run once more.
pytestmark = [pytest.mark.usefixtures("installed_host"), pytest.mark.flaky(reruns=2, reruns_delay=1)]
REAL_TIME = ("clock=wall", "cell.simulated.fidelity=winkler", "task.grip_aperture_m=0.021")


def wait(s):
    clock = WallClock()
    clock.sleep_until(clock.now() + round(s * 1e9))


def alive():
    return {thread.name for thread in threading.enumerate() if thread.name.startswith("lsds")}


def test_a_program_holds_moves_and_lets_go():
    job = lsds.HoldJob()
    threads, frozen = cv2.getNumThreads(), gc.get_freeze_count()
    with lsds.bring_up(overrides=REAL_TIME, job=job) as engine, engine.background() as grip:
        grip.wait_for("hold")
        assert job.held
        wait(0.3)
        assert grip.alive
        job.let_go()
        assert grip.wait(10.0)
    assert engine.released
    assert not alive()
    assert cv2.getNumThreads() == threads
    assert gc.get_freeze_count() <= frozen


def test_letting_go_before_the_run_has_begun_counts():
    job = lsds.HoldJob()
    job.let_go()
    session = lsds.run(overrides=["cell.simulated.fidelity=winkler"], job=job)
    assert session.fault is None
    assert session.summary["simulated_s"] < 0.1


def test_hold_lets_go_after_its_time():
    timed = ["job.backend=hold", "job.hold.duration_s=0.5", "cell.simulated.fidelity=winkler"]
    session = lsds.run(overrides=timed)
    assert session.summary["outcome"] == "released"
    held = [sample for sample in session.record.samples if sample.acting]
    assert 10 <= len(held) <= 14


def program(job, body, *overrides):
    """Run a body next to the engine; return the values passed to it."""
    with lsds.bring_up(overrides=[*REAL_TIME, *overrides], job=job) as engine, engine.background() as grip:
        body(grip)
    return grip


def test_the_run_ends_with_the_program_that_it_is_next_to():
    given = []

    def breaks(grip):
        given.append(grip)
        wait(0.1)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        program(lsds.HoldJob(), breaks)
    assert not given[0].alive
    assert not alive()


def test_the_error_that_ends_the_run_is_raised_in_the_program():
    class Broken(lsds.HoldJob):
        def step(self, now):
            raise ValueError("no idea what to do")

    with pytest.raises(PluginError, match="no idea what to do"):
        program(Broken(), lambda grip: grip.wait_for("hold"))
    assert not alive()


def test_a_stage_that_is_not_reached_is_an_error_that_names_the_current_stage():
    with pytest.raises(DataError, match=r"did not reach 'dance' within 0\.2 s; it is at"):
        program(lsds.HoldJob(), lambda grip: grip.wait_for("dance", timeout_s=0.2))


def test_the_virtual_clock_has_no_background():
    with pytest.raises(ConfigError, match="iterate over the engine"):
        program(lsds.HoldJob(), wait, "clock=virtual")


def test_a_slow_body_trips_the_watchdog():
    def slowly():
        with lsds.bring_up(overrides=[*REAL_TIME, "safety.watchdog_s=0.2"]) as engine:
            for _ in engine:
                wait(0.5)

    with pytest.raises(SafetyStop, match="watchdog: the loop was silent"):
        slowly()


def test_leaving_the_loop_stops_the_cell_and_keeps_the_grip():
    with lsds.bring_up(overrides=["cell.simulated.fidelity=winkler"]) as engine:
        for cycle in engine:
            if cycle.acting:
                break
        del cycle
        rig = engine.rig
        rig.clock.sleep_until(rig.clock.now() + 1_000_000_000)
        assert rig.arm.read().tcp_twist.linear_m_s == pytest.approx((0, 0, 0), abs=1e-6)
        assert rig.gripper.read().aperture_m < 0.0245


def test_an_engine_runs_once():
    with lsds.bring_up(overrides=["cell.simulated.fidelity=winkler", "task.lift_s=0.1", "task.hold_s=0"]) as engine:
        engine.run()
        with pytest.raises(RuntimeError, match="build a new one"):
            engine.run()
