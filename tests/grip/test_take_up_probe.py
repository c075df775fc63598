"""Taking up the load, and probing for the least grip: their end, and the controller's commands meanwhile."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from lsds.contracts import GripEstimate, GripperState, Situation
from lsds.jobs.probe import Probe
from lsds.jobs.take_up import TakeUp
from lsds.session.run import run
from tests.grip.test_belief_control import TICK_M, Grip

MS = 1_000_000


def seen(t_ms, load_n, *, slips=0.02, aperture_m=0.02):
    grip = GripEstimate(load_n=math.nan if load_n is None else load_n, slips=slips)
    cycle = SimpleNamespace(t_ns=t_ms * MS, grip=grip)
    state = GripperState(t_ms * MS, 0, aperture_m, 0.0, moving=False)
    return Situation(t_ms * MS, cycle=cycle, gripper=state)


def until_over(load_of, slips=lambda t_ms: False):
    take_up = TakeUp(0)
    for t_ms in range(0, 10_000, 40):
        if take_up.step(seen(t_ms, load_of(t_ms), slips=0.9 if slips(t_ms) else 0.02)):
            return t_ms
    return None


def test_it_is_taken_up_when_the_load_does_not_grow_any_more():
    assert 800 <= until_over(lambda t_ms: min(t_ms / 600, 1.0)) <= 1100


def test_nothing_is_taken_up_before_anything_pulls():
    assert until_over(lambda t_ms: 0.0) > 2900
    assert 1800 < until_over(lambda t_ms: 0.0 if t_ms < 1600 else 1.0) < 2300


def test_a_slipping_object_is_not_lifted_faster():
    assert until_over(lambda t_ms: 1.0 if t_ms else 0.0, slips=lambda t_ms: 100 < t_ms < 6000) > 6200


def test_an_object_that_may_slide_is_not_lifted_faster_for_a_time():
    take_up = TakeUp(0)
    over = [take_up.step(seen(t, min(t / 100, 1.0), slips=0.3 if t < 2000 else 0.0)) for t in range(0, 4000, 40)]
    assert 2000 <= 40 * over.index(True) < 2600
    take_up = TakeUp(0)
    over = [take_up.step(seen(t, min(t / 100, 1.0), slips=0.3)) for t in range(0, 4000, 40)]
    assert 2900 < 40 * over.index(True) < 3200
    assert not take_up.has_load


def test_a_load_that_is_not_known_is_none():
    assert until_over(lambda t_ms: None) > 2900
    assert until_over(lambda t_ms: None if t_ms < 1000 else 1.0) < 1600


def test_a_time_that_is_up_is_no_load():
    take_up = TakeUp(0)
    assert [take_up.step(seen(t, 0.0)) for t in range(0, 4000, 40)][-1]
    assert not take_up.has_load


def test_probing_is_over_when_the_fingers_rest():
    probe = Probe(0)
    assert not any(probe.step(seen(t, 1.0, aperture_m=0.02 + 1e-6 * t)) for t in range(0, 3000, 40))
    assert [probe.step(seen(t, 1.0, aperture_m=0.023)) for t in range(3000, 4000, 40)].index(True) * 40 > 700
    probe = Probe(0)
    moving = [probe.step(seen(t, 1.0, aperture_m=0.02 + 1e-6 * t)) for t in range(0, 20_000, 100)]
    assert moving.index(True) == 101


class Hanging(Grip):
    """An object of 1 N a finger that slips below 1 mm of squeeze; commands are carried out at once, in ticks."""

    stands = False

    def frame(self, load_n, **more):
        mm = 1e3 * TICK_M
        super().frame(load_n, False, **more)
        self.squeeze_mm = self.sent_mm = 25.0 - round((25.0 - self.sent_mm) / mm) * mm

    def probe(self, frames=200):
        self.frame(0.0)
        for _ in range(frames):
            self.stands |= self.squeeze_mm < 1.0
            self.frame(0.5 if self.stands else 1.0, probes=True)


def test_probing_opens_until_the_load_gives_way_and_closes_to_the_margin():
    hanging = Hanging(3.0)
    hanging.probe()
    assert hanging.stands
    # It slips at 0.78 mm, a tick below what held.
    assert 0.99 < hanging.squeeze_mm < 2.3


def test_without_probing_nothing_opens():
    hanging = Hanging(3.0)
    hanging.frame(0.0)
    for _ in range(100):
        hanging.frame(1.0)
    assert hanging.squeeze_mm == pytest.approx(3.0)


def test_a_probe_without_a_slip_adds_the_margin_to_the_grip_that_held():
    hanging = Hanging(0.9)
    hanging.stands = True
    hanging.probe()
    for _ in range(5):
        hanging.frame(0.8)
    # The load rises by more than half at once: the margin of 1.2 on the grip that held, and a tick.
    assert 0.5 < hanging.squeeze_mm < 0.9 * 1.2 ** (1 / 1.25) + 1e3 * TICK_M


def test_a_controller_that_never_opens_does_not_probe():
    hanging = Hanging(3.0, release_m_s=0.0)
    hanging.probe()
    assert hanging.squeeze_mm == pytest.approx(3.0)


def test_a_fragile_object_is_not_squeezed_beyond_its_maximum_force():
    hanging = Hanging(1.0)
    hanging.frame(0.0)
    for _ in range(30):
        hanging.frame(0.5, fragile_n=2.0, normal_n=1.5)
    for _ in range(30):
        hanging.frame(5.0, fragile_n=2.0, normal_n=1.5)
    assert 1.0 <= hanging.squeeze_mm < 1.2


@pytest.mark.parametrize("name", ["battery", "candle"])
def test_probing_finds_the_least_grip_in_the_cell(name, installed_host):
    found = {}
    for probe in (False, True):
        keys = [f"cell.simulated.object={name}", "task.first_squeeze_m=0.0028", f"task.probe={str(probe).lower()}"]
        session = run(None, [*keys, "task.lift_s=1.0"])
        assert session.summary["outcome"] == "held", session.fault
        found[probe] = session.summary
    needed = found[True]["required_normal_force_n"]
    assert found[True]["steady_normal_force_n"] < 1.8 * needed < found[False]["steady_normal_force_n"]
    assert found[True]["slip_distance_m"] < 2e-3


def test_a_controller_that_found_nothing_to_open_leaves_the_grip_as_it_was():
    hanging = Hanging(3.0, release_m_s=0.0)
    hanging.probe(60)
    for _ in range(20):
        hanging.frame(1.0)
    assert hanging.squeeze_mm == pytest.approx(3.0)


def test_fingers_that_have_not_moved_yet_are_waited_for():
    probe = Probe(0)
    assert [probe.step(seen(t, 1.0)) for t in range(0, 4000, 40)].index(True) * 40 > 2400


def test_the_time_in_which_the_arm_waits_is_no_part_of_the_take_up():
    take_up = TakeUp(0)
    over = []
    for t in range(0, 8000, 40):
        waits = t < 2000
        over.append(take_up.step(seen(t, 1.0 + t // 40 % 2, slips=0.9 if waits else 0.02)))
        if waits:
            take_up.wait(40 * MS)
    assert 4900 < 40 * over.index(True) < 5100


def test_a_load_that_falls_into_its_noise_gives_way_while_probing():
    hanging = Hanging(1.3)
    hanging.frame(0.0)
    for _ in range(12):
        hanging.frame(0.5, probes=True)
    before_mm = hanging.squeeze_mm
    hanging.frame(0.01, probes=True)
    assert hanging.squeeze_mm > before_mm
