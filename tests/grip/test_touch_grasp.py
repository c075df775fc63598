"""Grasp by touch in the simulated cell: placed, gentle if the object is fragile, and an error for each failure."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from lsds_research.collecting.objects import PLANS

from lsds.contracts import Contact, ContactPatch, GripperSpec, GripperState, Setting, Situation, Wanted
from lsds.contracts.task import TaskOptions
from lsds.errors import SafetyStop
from lsds.jobs.find_touch import TouchGrasp
from lsds.jobs.grasp import Grasp, begin_grasp
from lsds.session.run import run

pytestmark = pytest.mark.usefixtures("installed_host")
MS = 1_000_000
SPEC = GripperSpec(0.05, 50e-3 / 225, (0.02, 0.15), (20.0, 130.0))


class OnlyGrasp:
    """A job that grasps and ends."""

    def begin(self, setting):
        self.grasp = begin_grasp(setting.task, setting)
        self.stages = []

    def step(self, now):
        done = self.grasp.step(now)
        if self.grasp.stage not in self.stages:
            self.stages.append(self.grasp.stage)
        return Wanted("done" if done else self.grasp.stage, grip=None if done else self.grasp.grip, done=done)


def grasped(name, *overrides):
    job = OnlyGrasp()
    session = run(None, [f"cell.simulated.object={name}", "detector.backend=threshold", *overrides], job=job)
    assert session.fault is None, session.fault
    return job, max(truth.normal_force_n for truth in session.truths), session.truths[-1]


@pytest.mark.parametrize("name", ["pvc-pipe", "ball", "sponge", "book", "plank"])
def test_the_touch_is_placed_and_the_squeeze_counts_from_it(name):
    job, _, truth = grasped(name)
    assert job.stages == ["reference", "approach", "back off", "touch", "squeeze"]
    assert job.grasp.touch_m == pytest.approx(PLANS[name].thickness_mm * 1e-3, abs=4e-4)
    assert truth.aperture_m == pytest.approx(job.grasp.touch_m - 1e-3, abs=3e-4)
    assert truth.supported


def test_a_fragile_object_is_approached_by_ticks_from_the_start():
    job, peak_n, _ = grasped("ball", "task.fragile_n=0.6")
    assert job.stages == ["reference", "touch", "squeeze"]
    assert peak_n < 0.6


SETTING = Setting(0, TaskOptions(), SPEC, fingers=("left", "right"))


def situation(t_ms, aperture_m, **more):
    state = GripperState(t_ms * MS, 0, aperture_m, 0.0, **{"moving": True, "contact": Contact.NONE, **more})
    return Situation(t_ms * MS, referenced=True, gripper=state, arrived=not state.moving)


class Finder:
    """A finder with given results."""

    def __init__(self, **changes):
        self.frames, self.seen_ns, self.touching, self.apart, self.touch_m, self.std_m = 100, 10**12, False, (), 0.02, 0
        self.silent = 0.0
        vars(self).update(changes)

    def see(self, now):
        self.frames += 1

    def silent_s(self, now_ns):
        return self.silent, "left"

    def again(self):
        pass


def beginning(setting=SETTING, **options):
    grasp = TouchGrasp(TaskOptions(**{"timeout_s": 2.0, **options}), SPEC, setting)
    grasp._finder = Finder()
    return grasp


def approaching(**options):
    grasp = beginning(**options)
    grasp.step(situation(10, 0.05, moving=False))
    assert grasp.stage == "approach"
    return grasp


def squeezing(**changes):
    grasp = approaching()
    grasp.stage, grasp._finder = "squeeze", Finder(**changes)
    return grasp


def test_fingers_that_close_on_nothing_stop_the_cell():
    grasp = approaching()
    with pytest.raises(SafetyStop, match="nothing there"):
        grasp.step(situation(2000, 0.0, moving=False))


def test_fingers_that_stop_without_contact_on_the_gel_stop_the_cell():
    grasp = approaching()
    with pytest.raises(SafetyStop, match=r"20\.0 mm on something that the gel does not feel"):
        grasp.step(situation(1000, 0.02, moving=False, contact=Contact.CLOSING))


def test_fingers_that_stop_before_the_frame_of_their_touch_are_given_that_frame():
    grasp = approaching()
    grasp._finder.seen_ns = 958 * MS
    grasp.step(situation(1000, 0.02, moving=False, contact=Contact.CLOSING))
    grasp._finder.seen_ns, grasp._finder.touching = 1020 * MS, True
    grasp.step(situation(1040, 0.02, moving=False, contact=Contact.CLOSING))
    assert grasp.stage == "back off"


def test_a_frame_after_the_stop_that_shows_no_touch_stops_the_cell():
    grasp = approaching()
    grasp._finder.seen_ns = 958 * MS
    grasp.step(situation(1000, 0.02, moving=False, contact=Contact.CLOSING))
    grasp._finder.seen_ns = 1001 * MS
    with pytest.raises(SafetyStop, match="gel does not feel"):
        grasp.step(situation(1040, 0.02, moving=False, contact=Contact.CLOSING))


def test_an_earlier_stop_does_not_count_for_a_later_one():
    grasp = approaching()
    grasp._finder.seen_ns = 958 * MS
    grasp.step(situation(1000, 0.02, moving=False, contact=Contact.CLOSING))
    grasp._finder.seen_ns = 990 * MS
    grasp.step(situation(1500, 0.02, moving=False))
    grasp._finder.seen_ns = 1550 * MS
    grasp.step(situation(1600, 0.019, moving=False, contact=Contact.CLOSING))
    assert grasp.stage == "approach"


def test_fingers_that_do_not_follow_stop_the_cell():
    grasp = approaching()
    with pytest.raises(SafetyStop, match=r"nothing was grasped.*does the gripper follow"):
        grasp.step(situation(60_000, 0.05))


def test_a_touch_before_the_fingers_close_stops_the_cell():
    grasp = beginning()
    grasp._finder.touching = True
    with pytest.raises(SafetyStop, match="before the fingers close"):
        grasp.step(situation(10, 0.05, moving=False))


def test_a_finger_without_touch_is_named():
    grasp = squeezing(touching=True, apart=("right",))
    with pytest.raises(SafetyStop, match="finger right does not touch"):
        grasp.step(situation(100, 0.019, moving=False))


def test_a_contact_at_the_edge_of_a_pad_is_an_error():
    depth = np.zeros((30, 40), np.float32)
    depth[10:20, 34:] = 3e-4
    seen = SimpleNamespace(
        finger="left", frame=None, observation=SimpleNamespace(contact=ContactPatch(depth, 5e-5, 0.05), load=None)
    )
    grasp = squeezing(touching=True)
    with pytest.raises(SafetyStop, match="finger left touches the object at the right edge of its pad only"):
        grasp.step(replace(situation(100, 0.019, moving=False), fingers=(seen,)))


def test_a_depth_at_the_edge_that_was_there_without_contact_is_no_contact_at_the_edge():
    depth = np.zeros((30, 40), np.float32)
    depth[10:20, 34:] = 3e-4
    contact = ContactPatch(depth, 5e-5, 0.05)
    seen = SimpleNamespace(finger="left", frame=None, observation=SimpleNamespace(contact=contact, load=None))
    grasp = squeezing()
    grasp.stage = "touch"
    grasp.step(replace(situation(50, 0.022), fingers=(seen,)))
    grasp.stage, grasp._finder.touching = "squeeze", True
    grasp.step(replace(situation(100, 0.019, moving=False), fingers=(seen,)))


def test_a_touch_that_was_light_only_is_no_grasp():
    grasp = squeezing(apart=("left", "right"))
    assert not grasp.step(situation(100, 0.019, moving=False))
    assert grasp.stage == "touch"
    assert math.isnan(grasp.touch_m)


def test_a_grasp_is_judged_by_frames_of_after_the_squeeze():
    grasp = squeezing(touching=True, seen_ns=90 * MS)
    assert not grasp.step(situation(100, 0.019, moving=False))
    grasp._finder.seen_ns = 101 * MS
    assert grasp.step(situation(120, 0.019, moving=False))


def test_blind_fingers_wait_and_then_stop_the_cell():
    grasp = approaching()
    assert grasp.grip.aperture_m == 0
    grasp._finder.silent = 0.2
    grasp.step(situation(200, 0.041))
    assert grasp.grip.aperture_m == pytest.approx(0.041)
    grasp._finder.silent = 0.0
    grasp.step(situation(300, 0.041))
    assert grasp.grip.aperture_m == 0
    grasp._finder.silent = 1.1
    with pytest.raises(SafetyStop, match=r"finger left has shown nothing new for 1\.1 s.*check its camera"):
        grasp.step(situation(400, 0.041))


def test_until_the_squeeze_the_gripper_pushes_with_its_least_force():
    grasp = approaching()
    assert grasp.grip.force_n == SPEC.force_n[0]
    grasp.stage, grasp._finder.touching = "touch", True
    grasp.step(situation(200, 0.02))
    assert grasp.stage == "squeeze"
    assert grasp.grip.force_n == TaskOptions().grip_force_n


def test_ticks_wait_for_frames_and_those_of_a_fragile_object_for_rest():
    grasp = approaching()
    grasp.stage, grasp.grip = "touch", None
    grasp.step(situation(200, 0.02))
    first_m = grasp.grip.aperture_m
    grasp._finder.see = lambda now: None
    for t_ms in range(210, 500, 10):
        grasp.step(situation(t_ms, first_m))
    assert grasp.grip.aperture_m == first_m

    grasp = beginning(fragile_n=0.6)
    grasp.step(situation(10, 0.05, moving=False))
    assert grasp.stage == "touch"
    grasp.step(situation(200, 0.05, moving=False))
    first_m = grasp.grip.aperture_m
    grasp.step(situation(300, 0.05, moving=True))
    assert grasp.grip.aperture_m == first_m, "before it has come to rest"
    grasp._finder.seen_ns = 390 * MS
    grasp.step(situation(400, first_m, moving=False))
    assert grasp.grip.aperture_m == first_m, "before the gel was seen then"
    grasp._finder.seen_ns = 410 * MS
    grasp.step(situation(450, first_m, moving=False))
    assert grasp.grip.aperture_m < first_m


def test_the_least_aperture_of_the_cell_ends_the_approach_and_refuses_a_squeeze():
    setting = Setting(0, TaskOptions(), SPEC, fingers=("left",), apertures_m=(0.0196, math.inf))
    grasp = beginning(setting)
    grasp.step(situation(10, 0.05, moving=False))
    assert grasp.grip.aperture_m == 0.0196
    with pytest.raises(SafetyStop, match=r"closed to 19\.6 mm, as far as they may, without a touch"):
        grasp.step(situation(2000, 0.0197, moving=False))
    grasp.stage, grasp._finder.touching = "touch", True
    with pytest.raises(SafetyStop, match=r"touched at 20\.0 mm.*safety\.min_aperture_m"):
        grasp.step(situation(2000, 0.02))


def test_a_configured_aperture_is_used():
    assert TaskOptions().grasp == "touch"
    assert TaskOptions(grip_aperture_m=0.02).grasp == "aperture"
    assert TaskOptions(grip_aperture_m=0.02, grasp="touch").grasp == "touch"
    assert isinstance(begin_grasp(TaskOptions(grip_aperture_m=0.02), Setting(0, TaskOptions(), SPEC)), Grasp)


def test_a_grasp_to_an_aperture_sees_its_touch_too():
    job, _, _ = grasped("pvc-pipe", "task.grip_aperture_m=0.0236")
    assert math.isfinite(job.grasp.touch_m)
    assert job.grasp.touch_m == pytest.approx(0.025, abs=2e-3)
