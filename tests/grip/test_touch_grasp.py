"""Grasp by touch in the simulated cell: placed, gentle where the object is fragile, and each failure said."""

from __future__ import annotations

import math

import pytest
from lsds_research.collecting.objects import PLANS

from lsds.contracts import Contact, GripperSpec, GripperState, Setting, Situation, Wanted
from lsds.errors import SafetyStop
from lsds.jobs.grasp import Grasp, begin_grasp
from lsds.jobs.touch import TouchGrasp
from lsds.session.run import run
from lsds.task import TaskOptions

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


def situation(t_ms, aperture_m, **more):
    state = GripperState(t_ms * MS, 0, aperture_m, 0.0, **{"moving": True, "contact": Contact.NONE, **more})
    return Situation(t_ms * MS, referenced=True, gripper=state, arrived=not state.moving)


def approaching():
    grasp = TouchGrasp(TaskOptions(timeout_s=2.0), SPEC, 0)
    grasp._finder.frames = 100
    grasp.step(situation(10, 0.05, moving=False))
    assert grasp.stage == "approach"
    return grasp


def test_fingers_that_close_on_nothing_stop_the_cell():
    grasp = approaching()
    with pytest.raises(SafetyStop, match="nothing there"):
        grasp.step(situation(2000, 0.0, moving=False))


def test_fingers_that_stop_on_what_the_gel_does_not_feel_stop_the_cell():
    grasp = approaching()
    with pytest.raises(SafetyStop, match=r"20\.0 mm on something that the gel does not feel"):
        grasp.step(situation(1000, 0.02, moving=False, contact=Contact.CLOSING))


def test_fingers_that_do_not_follow_stop_the_cell():
    grasp = approaching()
    with pytest.raises(SafetyStop, match=r"nothing was grasped.*does the gripper follow"):
        grasp.step(situation(60_000, 0.05))


def test_a_touch_before_the_fingers_close_stops_the_cell():
    grasp = TouchGrasp(TaskOptions(), SPEC, 0)
    grasp._finder.frames = 100
    grasp._finder._touching["left"] = True
    with pytest.raises(SafetyStop, match="before the fingers close"):
        grasp.step(situation(10, 0.05, moving=False))


def test_a_finger_without_touch_is_named():
    grasp = approaching()
    grasp.stage = "squeeze"
    grasp._finder._senses = {"left": None, "right": None}
    grasp._finder._touched_m = {"left": (0.02, 1e-4)}
    with pytest.raises(SafetyStop, match="finger right does not touch"):
        grasp.step(situation(100, 0.019, moving=False))


def test_an_aperture_that_is_told_is_meant():
    assert TaskOptions().grasp == "touch"
    assert TaskOptions(grip_aperture_m=0.02).grasp == "aperture"
    assert TaskOptions(grip_aperture_m=0.02, grasp="touch").grasp == "touch"
    assert isinstance(begin_grasp(TaskOptions(grip_aperture_m=0.02), Setting(0, TaskOptions(), SPEC)), Grasp)


def test_a_grasp_to_an_aperture_sees_its_touch_too():
    job, _, _ = grasped("pvc-pipe", "task.grip_aperture_m=0.0236")
    assert math.isfinite(job.grasp.touch_m)
    assert job.grasp.touch_m == pytest.approx(0.025, abs=2e-3)
