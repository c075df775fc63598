"""Safety tests for every job: after any failure the arm stops, the grip does not open, and one error gives the
reason."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from lsds_plugins.jobs.lift import LiftJob
from lsds_research.collecting.job import TrialJob
from lsds_research.collecting.trials import trials

from lsds.config import load_config
from lsds.contracts import Frame, Grip, Twist, Wanted
from lsds.errors import DeviceError, PluginError, SafetyStop, StaleData
from lsds.jobs import HoldJob, WatchJob
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig

pytestmark = pytest.mark.usefixtures("installed_host")
QUICK = ("cell.simulated.fidelity=winkler", "task.grip_aperture_m=0.0236", "task.lift_s=4.0", "task.timeout_s=3.0")
FAULT_S = 3.3
"""Every job holds an object by then, has opened to what holds it, and lift, trial and place move the arm. An opening
after that is the failure's."""


class PlaceJob:
    """A third-party job: grasp, lift, lower, release; using only the public contract."""

    def begin(self, setting):
        self.start, self.task = setting.t_ns, setting.task
        self.grasped = None

    def step(self, now):
        if not now.referenced:
            return Wanted("look")
        if self.grasped is None:
            if now.arrived:
                self.grasped = now.t_ns
            return Wanted("close", grip=Grip(0.0222, 0.05, 60.0))
        t = (now.t_ns - self.grasped) / 1e9
        if t < 3.0:
            return Wanted("up", corrects=True, twist=Twist((0.0, 0.0, 0.03)))
        if t < 6.2:
            return Wanted("down", corrects=True, twist=Twist((0.0, 0.0, -0.03)))
        return Wanted("open", grip=Grip(0.035, 0.05, 60.0), done=t > 7.0)


def trial_job():
    [trial] = [t for t in trials("severity", ["can"], 0) if t.protocol == "severity"][:1]
    return TrialJob(trial, measured=False)


JOBS = {
    "lift": (LiftJob, ()),
    "hold": (HoldJob, ()),
    "watch": (WatchJob, ()),
    "trial": (trial_job, ("cell.simulated.object=can", "cell.simulated.clamped=true")),
    "place": (PlaceJob, ()),
}
MOVING = {"lift", "trial", "place"}


class Bench:
    """A rig whose every command is written down, with the time at which it was sent."""

    def __init__(self, name, *overrides, wrap=lambda bench: None):
        make, own = JOBS[name]
        self.config = load_config(None, [*QUICK, *own, *overrides])
        self.error = None
        self.moves, self.grips, self.seen = [], [], []
        with Rig(self.config) as rig:
            self.rig, self.job = rig, make()
            self.start = rig.clock.now()
            self._write_down(rig.arm, self.moves, lambda c: math.hypot(*c.twist.linear_m_s, *c.twist.angular_rad_s))
            self._write_down(rig.gripper, self.grips, lambda c: c.aperture_m)
            rig.arm_devices()
            reads = rig.arm.read, rig.gripper.read
            wrap(self)
            self.engine = Engine(rig, self.job)
            self.engine.observers.add("seen", self.seen.append)
            self.engine.every("patience", self._give_up, 1.0)
            try:
                self.engine.run()
            except (SafetyStop, DeviceError, PluginError, KeyboardInterrupt) as error:
                self.error = error
            self.ended_s = self.now_s
            rig.clock.sleep_until(rig.clock.now() + 500_000_000)
            self.arm, self.gripper = (read() for read in reads)

    @property
    def now_s(self):
        return (self.rig.clock.now() - self.start) / 1e9

    def _give_up(self, now_ns):
        if self.now_s > 12:
            self.engine.stop()

    def _write_down(self, device, sent, of):
        command = device.command

        def sending(asked):
            done = command(asked)
            sent.append((self.now_s, of(done)))
            return done

        device.command = sending

    def after(self, t_s, sent):
        return [value for at, value in sent if at > t_s]

    def from_then_on(self, fault):
        """Replace the sensor's frames by `fault(frame)` from `FAULT_S` on."""
        read = self.rig.sensor.read

        def reading():
            frame = read()
            return frame if self.now_s < FAULT_S else fault(frame)

        self.rig.sensor.read = reading


def dead(bench):
    def fault(frame):
        raise StaleData("sensor", "unplugged")

    bench.from_then_on(fault)


def blind(bench):
    rng = np.random.default_rng(0)
    bench.from_then_on(lambda f: Frame(rng.integers(100, 140, f.image.shape, np.uint8), f.t_ns, f.seq))


def black(bench):
    bench.from_then_on(lambda f: Frame(np.zeros_like(f.image), f.t_ns, f.seq))


def late(bench):
    bench.from_then_on(lambda f: Frame(f.image, f.t_ns - 400_000_000, f.seq))


def stuck(bench):
    kept = []

    def fault(frame):
        kept.append(frame)
        return Frame(kept[0].image, frame.t_ns, frame.seq)

    bench.from_then_on(fault)


def silent_gripper(bench):
    read = bench.rig.gripper.read

    def reading():
        if bench.now_s >= FAULT_S:
            raise StaleData("gripper", "unplugged")
        return read()

    bench.rig.gripper.read = reading


def silent_arm(bench):
    read = bench.rig.arm.read

    def reading():
        if bench.now_s >= FAULT_S:
            raise StaleData("arm", "unplugged")
        return read()

    bench.rig.arm.read = reading


def interrupt(bench):
    def fault(frame):
        raise KeyboardInterrupt

    bench.from_then_on(fault)


def raising(bench):
    step = bench.job.step

    def stepping(now):
        if bench.now_s >= FAULT_S:
            raise ValueError("the job is broken")
        return step(now)

    bench.job.step = stepping


def wrong(bench):
    step = bench.job.step
    bench.job.step = lambda now: step(now) if bench.now_s < FAULT_S else "up, please"


FAULTS = {
    # fault: (how, limit in seconds, error, its message)
    "dead": (dead, 0.25, SafetyStop, "sensor: nothing usable.*unplugged"),
    "blind": (blind, 0.25, SafetyStop, "sensor: nothing usable.*(dots can be followed|whole image changes)"),
    "black": (black, 0.25, SafetyStop, "sensor: nothing usable.*black"),
    "late": (late, 0.25, SafetyStop, "sensor: nothing usable"),
    "repeated": (stuck, 0.25, SafetyStop, "sensor: nothing usable.*repeats one image"),
    "silent gripper": (silent_gripper, 0.25, SafetyStop, "gripper: nothing usable.*unplugged"),
    "silent arm": (silent_arm, 0.25, SafetyStop, "arm: nothing usable.*unplugged"),
    "Ctrl-C": (interrupt, 0.06, KeyboardInterrupt, ""),
    "job raises": (raising, 0.02, PluginError, "job .*raised ValueError.*the job is broken"),
    "job returns nonsense": (wrong, 0.02, PluginError, "job .*not Wanted"),
}


def requires_nothing(job, fault):
    """A job that depends on nothing may look at one image for good."""
    return fault == "repeated" and job == "watch"


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("job", JOBS)
def test_whatever_fails_nothing_runs_on_and_nothing_opens(job, fault):
    wrap, limit_s, error, message = FAULTS[fault]
    bench = Bench(job, wrap=wrap)
    if requires_nothing(job, fault):
        assert bench.error is None
        return
    moving_before = [value for at, value in bench.moves if FAULT_S - 0.2 < at < FAULT_S]
    assert any(moving_before) == (job in MOVING), "the fault has to come while the arm moves"
    assert isinstance(bench.error, error)
    assert re.search(message, str(bench.error)), str(bench.error)
    assert bench.ended_s < FAULT_S + limit_s + 0.05
    assert not any(bench.after(FAULT_S + limit_s, bench.moves)), "a moving command after the limit"
    assert bench.arm.tcp_twist.linear_m_s == pytest.approx((0, 0, 0), abs=1e-6)
    if job != "watch":
        held = [value for at, value in bench.grips if at <= FAULT_S][-1]
        assert all(value <= held + 1e-9 for value in bench.after(FAULT_S, bench.grips)), "it was commanded to open"
        assert bench.gripper.aperture_m <= held + 4e-4, "it opened"


@pytest.mark.parametrize("job", sorted(MOVING | {"hold"}))
def test_a_deaf_gripper_lifts_nothing(job):
    bench = Bench(job, "gripper.mock-hand-e.command_loss=1.0")
    if job == "place":
        assert bench.error is None, "it waits for good, as its author wrote it"
    else:
        assert isinstance(bench.error, SafetyStop)
        assert "nothing was grasped" in str(bench.error)
    assert not any(value for _, value in bench.moves)


@pytest.mark.parametrize("job", sorted(MOVING))
def test_an_arm_that_does_not_follow_is_noticed(job):
    bench = Bench(job, "arm.mock-ur5e.command_loss=1.0")
    assert isinstance(bench.error, SafetyStop)
    assert "arm: commanded" in str(bench.error)
    moving = [at for at, value in bench.moves if value]
    assert moving[-1] - moving[0] < 1.1


@pytest.mark.parametrize("job", sorted(MOVING))
def test_a_healthy_run_ends_by_itself(job):
    bench = Bench(job, "task.lift_s=1.0")
    assert bench.error is None
    assert bench.engine.done
    assert len(bench.seen) > 30


def test_hold_does_not_move_the_arm_reacts_to_slip_and_releases_on_request():
    bench_job = []

    def pull(bench):
        """The arm program of a user, and the time at which it releases the object."""
        bench_job.append(bench.job)
        arm, clock = bench.rig.arm, bench.rig.clock
        from lsds.contracts import ArmCommand

        def program(now_ns):
            if 2.6 < bench.now_s < 4.0:
                arm.command(ArmCommand(Twist((0.0, 0.0, 0.03)), 0.5, clock.now() + 100_000_000))
            if bench.now_s > 5.0:
                bench.job.let_go()

        bench.program = program

    class Pulled(Bench):
        def _give_up(self, now_ns):
            self.program(now_ns)

    Pulled_every = Engine.every
    try:
        Engine.every = lambda self, name, call, rate_hz: Pulled_every(self, name, call, 100.0)
        bench = Pulled("hold", "task.grip_aperture_m=0.0234", wrap=pull)
    finally:
        Engine.every = Pulled_every
    assert bench.error is None
    assert bench.engine.done
    assert bench.engine.released
    assert all(2.5 < at < 4.1 for at, _ in bench.moves), "only the program moved the arm"
    assert any(cycle.command_m is not None for cycle in bench.seen), "slip was answered"
    closed = min(value for at, value in bench.grips if at < 5.0)
    assert bench.grips[-1][1] > closed + 0.008
