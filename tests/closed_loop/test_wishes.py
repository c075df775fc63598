"""The engine executes a job's wishes safely: no opening by a late echo, no command after a stop, no malformed wish."""

from __future__ import annotations

import math

import pytest

import lsds
from lsds.clock import VirtualClock, WallClock
from lsds.contracts import GripperState
from lsds.errors import CommandExpired, LimitExceeded, PluginError, SafetyStop
from lsds.runtime.actuation import Actuation

pytestmark = pytest.mark.usefixtures("installed_host")
WINKLER = "cell.simulated.fidelity=winkler"
MS = 1_000_000


class Gripper:
    """Takes every command; `expired` refuses them."""

    def __init__(self):
        from lsds.contracts import GripperSpec

        self.spec = GripperSpec(0.05, 2e-4, (0.02, 0.15), (20.0, 130.0))
        self.sent, self.expired = [], False

    def command(self, command):
        if self.expired:
            raise CommandExpired("gripper", "too late")
        self.sent.append(command.aperture_m)
        return command


def acting(clock=None):
    gripper = Gripper()
    return Actuation(gripper, None, lsds.load_config(), clock or VirtualClock()), gripper


def state(t_ms, target, aperture=0.05):
    return GripperState(t_ms * MS, t_ms, aperture, target, moving=False)


def test_a_correction_that_overtakes_the_echo_is_never_undone():
    act, gripper = acting()
    wish = lsds.Grip(0.0236, 0.05, 60.0)
    act.grip(wish, state(0, 0.05), 0)
    assert act.correct(0.0226, may_open=False) == pytest.approx(0.0226)
    for t_ms in range(0, 2000, 8):
        act.grip(wish, state(t_ms, 0.0226), t_ms * MS)
    assert gripper.sent == pytest.approx([0.0236, 0.0226])


def test_a_correction_opens_by_a_step_at_most():
    """A controller's commands of earlier frames, as one that is late gives, would let an object fall."""
    act, gripper = acting()
    act.grip(lsds.Grip(0.0222, 0.05, 60.0), state(0, 0.05), 0)
    assert act.correct(0.0238, may_open=False) == pytest.approx(0.0222)
    assert act.correct(0.0238, may_open=True) == pytest.approx(0.0225)
    assert act.correct(0.05, may_open=True) == pytest.approx(0.0228)
    assert act.correct(0.02, may_open=True) == pytest.approx(0.02), "closing is not limited"
    with pytest.raises(LimitExceeded):
        act.correct(math.nan, may_open=True)
    assert gripper.sent[-1] == pytest.approx(0.02)


def test_a_grip_that_was_never_sent_is_never_arrived_at_and_ends_as_a_fault():
    clock = VirtualClock()
    act, gripper = acting(clock)
    act.grip(lsds.Grip(0.03, 0.05, 60.0), None, 0)
    resting = [act.arrived(state(t, 0.03, 0.03), t * MS) for t in range(10, 400, 10)]
    assert resting[-1]
    gripper.expired = True
    act.grip(lsds.Grip(0.02, 0.05, 60.0), state(400, 0.03, 0.03), 400 * MS)
    assert not act.arrived(state(800, 0.03, 0.03), 800 * MS)
    clock.sleep_until(1000 * MS)
    with pytest.raises(SafetyStop, match="every command expires"):
        act.grip(lsds.Grip(0.02, 0.05, 60.0), state(1000, 0.03, 0.03), 1000 * MS)


class Wants:
    """Wants one thing after another, by time (s)."""

    def __init__(self, *wishes):
        self.wishes = wishes

    def begin(self, setting):
        self.start = setting.t_ns

    def step(self, now):
        t = (now.t_ns - self.start) / 1e9
        return next(wish for until, wish in self.wishes if t < until)


@pytest.mark.parametrize(
    ("wish", "message"),
    [
        (lsds.Wanted("up", twist=(0.0, 0.0, 0.1)), "stage 'up': twist is .* not a Twist"),
        (lsds.Wanted("close", grip=0.02), "stage 'close': grip is 0.02, not a Grip"),
        (lsds.Wanted("up", twist=lsds.Twist((0.0, 0.0, math.nan))), "not all finite"),
        (lsds.Wanted("close", grip=lsds.Grip(math.inf, 0.05, 60.0)), "not all finite"),
        (lsds.Wanted("slide", slide=lsds.Slide(math.nan)), "not all finite"),
    ],
)
def test_a_malformed_wish_is_refused_before_anything_is_sent(wish, message):
    session = lsds.run(overrides=[WINKLER], job=Wants((9.0, wish)))
    assert isinstance(session.fault, PluginError)
    with pytest.raises(PluginError, match=message):
        raise session.fault


def test_nothing_is_sent_after_the_watchdog_has_stopped_the_cell():
    sent = []

    class Blocks:
        def begin(self, setting):
            self.steps = 0

        def step(self, now):
            self.steps += 1
            if self.steps == 5:
                clock = WallClock()
                clock.sleep_until(clock.now() + 800 * MS)
            return lsds.Wanted("up", grip=lsds.Grip(0.045, 0.05, 60.0), twist=lsds.Twist((0.0, 0.0, 0.02)))

    with lsds.bring_up(overrides=[WINKLER, "clock=wall", "safety.watchdog_s=0.2"], job=Blocks()) as engine:
        for device in (engine.rig.arm, engine.rig.gripper):
            command, stop = device.command, device.stop
            device.command = lambda asked, command=command: (sent.append("command"), command(asked))[1]
            device.stop = lambda stop=stop: (sent.append("stop"), stop())[1]
        with pytest.raises(SafetyStop, match="watchdog"):
            engine.run()
    assert "command" in sent
    assert "command" not in sent[sent.index("stop") :]


def test_the_controller_is_reset_when_a_job_grips_again():
    first, second = lsds.Grip(0.0225, 0.05, 60.0), lsds.Grip(0.0205, 0.05, 60.0)
    job = Wants(
        (0.7, lsds.Wanted("look")),
        (1.7, lsds.Wanted("close", grip=first)),
        (3.2, lsds.Wanted("hold", corrects=True)),
        (4.2, lsds.Wanted("closer", grip=second)),
        (4.7, lsds.Wanted("hold again", corrects=True)),
        (9.0, lsds.Wanted("done", done=True)),
    )
    opening = ["controller.pd.release_m_s=0.002", "controller.pd.release_after_s=0.2"]
    session = lsds.run(overrides=[WINKLER, *opening], job=job)
    assert session.fault is None
    again = [s.command_m for s in session.record.samples if s.stage == "hold again" and s.command_m is not None]
    assert all(command < 0.0215 for command in again), "it opened to where an earlier grip was"


def test_an_object_that_was_lifted_off_and_is_still_on_the_table_is_dropped():
    loose = ["controller.enabled=false", "task.grip_aperture_m=0.0249", "task.lift_s=1.0"]
    session = lsds.run(overrides=[WINKLER, *loose])
    assert any(sample.rising for sample in session.record.samples)
    assert session.summary["outcome"] == "dropped"


def test_fingers_out_of_step_do_not_count_their_intervals_twice():
    seen = []
    rates = ["sensors.left.mock-gelsight-mini.rate_hz=25", "sensors.right.mock-gelsight-mini.rate_hz=37"]
    fingers = ["sensors.right.mock-gelsight-mini.finger=right", *rates]
    with lsds.bring_up(overrides=[WINKLER, *fingers, "task.lift_s=1.0"]) as engine:
        update = engine.rig.controller.update
        engine.rig.controller.update = lambda grip, wanted: (seen.append(grip), update(grip, wanted))[1]
        leads = [cycle.leads for cycle in engine]
    assert set(leads) == {True, False}
    took = (seen[-1].t_ns - seen[0].t_ns) * 1e-9
    assert sum(grip.dt_s for grip in seen[1:]) == pytest.approx(took, abs=1e-6)


def test_a_rate_that_is_none_is_refused():
    from lsds.errors import ConfigError

    with lsds.bring_up(overrides=[WINKLER]) as engine, pytest.raises(ConfigError, match="0 Hz is not a rate"):
        engine.every("never", print, 0.0)


@pytest.mark.parametrize(
    ("options", "exact"),
    [
        (["task.lift_s=0.5"], True),
        (["job.backend=shake", "job.shake.still_s=0.2", "job.shake.lift_s=0.3", "job.shake.corrects=true"], True),
        (["job.backend=slide", "job.slide.slide_s=0.5"], True),
        (["job.backend=hold", "job.hold.duration_s=0.5"], True),
        (["task.grasp=aperture", "task.lift_s=0.5"], False),
    ],
)
def test_the_watch_on_closings_gets_how_exactly_the_touch_is_known(options, exact, monkeypatch):
    stds_m = []
    monkeypatch.setattr(
        "lsds.safety.press_watch.PressWatch.see", lambda watch, grip, squeeze_m, touch_std_m: stds_m.append(touch_std_m)
    )
    session = lsds.run(lsds.load_config(None, [WINKLER, "task.settle_s=0.1", "task.hold_s=0.1", *options]))
    assert session.fault is None, session.fault
    assert stds_m
    # Between two frames at 5 mm/s, or at the speed of a grasp.
    assert all(0 < std_m < 2e-4 if exact else std_m == 1e-3 for std_m in stds_m)


@pytest.mark.parametrize("std_m", [-1e-3, math.nan, math.inf])
def test_a_touch_without_a_sound_uncertainty_is_a_mistake_of_the_job(std_m):
    job = Wants((9.0, lsds.Wanted("hold", grip=lsds.Grip(0.0236, 0.05, 20.0), touch_m=0.025, touch_std_m=std_m)))
    session = lsds.run(lsds.load_config(None, [WINKLER]), job=job)
    assert "touch_std_m" in str(session.fault)
