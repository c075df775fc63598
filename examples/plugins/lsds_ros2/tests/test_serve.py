"""The job alone, at times that are hard to meet in a cell."""

from __future__ import annotations

import lsds
from lsds.contracts import GripperState, Setting, Situation
from lsds.contracts.task import TaskOptions
from lsds.contracts.values import GripperSpec

from lsds_ros2.serve import GripGoal, Serve

SPEC = GripperSpec(0.05, 2e-4, (0.02, 0.15), (20.0, 185.0))


def job_with(goal: GripGoal, aperture_m: float) -> Serve:
    """Return a job whose fingers are on their way to a goal."""
    job = Serve()
    job.begin(Setting(0, TaskOptions(), SPEC))
    job.aim(goal)
    step(job, 0.01, aperture_m, moving=True)
    assert len(goal.ended) == 0
    return job


def step(job: Serve, t_s: float, aperture_m: float, *, moving: bool) -> lsds.Wanted:
    t_ns = round(t_s * 1e9)
    state = GripperState(t_ns, 0, aperture_m, 0.0, moving)
    return job.step(Situation(t_ns, referenced=True, gripper=state))


def test_a_goal_that_takes_too_long_is_late_and_the_fingers_stop() -> None:
    goal = GripGoal(0.045)
    job = job_with(goal, 0.02)
    step(job, 9.0, 0.03, moving=True)
    assert len(goal.ended) == 0
    wanted = step(job, 10.1, 0.03, moving=True)
    assert goal.ended == "late"
    assert wanted.grip is not None
    assert wanted.grip.aperture_m == 0.03


def test_a_goal_is_met_when_the_controller_has_closed_beyond_it() -> None:
    goal = GripGoal(0.022)
    job = job_with(goal, 0.023)
    job._holds = True
    step(job, 0.1, 0.021, moving=True)
    assert len(goal.ended) == 0
    step(job, 0.2, 0.021, moving=False)
    assert goal.ended == "stalled"


def test_the_force_of_a_goal_is_that_of_the_grip() -> None:
    job = job_with(GripGoal(0.022, force_n=33.0), 0.04)
    wanted = step(job, 0.1, 0.03, moving=True)
    assert wanted.grip is not None
    assert wanted.grip.force_n == 33.0
