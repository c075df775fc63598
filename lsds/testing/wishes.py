"""Checks of jobs: what they want is sound and within the limits of the devices, from the first step to the last."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from typing import Any

import pytest

from lsds.contracts import Grip, Slide, Twist, Wanted
from lsds.errors import ConfigError, SafetyStop
from lsds.testing.bench import Bench
from lsds.testing.feeding import build
from lsds.testing.situations import ARM, GRIPPER, Grasp, World, setting

LONGEST_S = 40.0
"""Time after which a run is left, because a job may go on until its user ends it."""
BOUND_S = 2.0
"""The first step has to return within this, in real time."""
GRASPS: tuple[Grasp, ...] = ("aperture", "touch")


def check_first_step_is_answered(bench: Bench) -> None:
    """The first step, before anything was read, returns within 2 s a Wanted that moves nothing."""
    job = build(bench)
    answered: list[Any] = []
    raised: list[AssertionError] = []

    def step() -> None:
        try:
            answered.append(_stepped(job, World(), "first step"))
        except AssertionError as error:
            raised.append(error)

    thread = threading.Thread(target=step, daemon=True)
    thread.start()
    thread.join(BOUND_S)
    assert not thread.is_alive(), (
        f"the first step did not return within {BOUND_S} s; a job never waits, it is asked again"
    )
    if raised:
        raise raised[0]
    assert answered[0] is not None, "the first step raised SafetyStop; wait until something was read"
    wanted = answered[0][0]
    problem = _problem(wanted)
    assert not problem, f"first step: {problem}"
    assert wanted.grip is None, f"first step: it wants {wanted.grip} before the gel without contact was seen; wait"
    assert not _moves(wanted), f"first step: it wants {wanted.twist} before anything was read; wait"


def check_wants_are_sound(bench: Bench) -> None:
    """Every step gives a Wanted of finite numbers with a named stage; only SafetyStop ends a run as a fault."""
    for where, wanted in _runs(bench):
        problem = _problem(wanted)
        assert not problem, f"{where}: {problem}"


def check_stages_are_declared(bench: Bench) -> None:
    """Where a job has `stages`, every stage that it is in is one of them."""
    stages = getattr(build(bench), "stages", None)
    if stages is None:
        return
    for where, wanted in _runs(bench):
        stage = getattr(wanted, "stage", None)
        assert stage in stages, f"{where}: stage {stage!r} is not in stages {tuple(stages)}; add it"


def check_wants_are_within_limits(bench: Bench) -> None:
    """Speeds, forces, apertures and accelerations are within what the specs of gripper and arm allow."""
    for where, wanted in _runs(bench):
        for what, value, least, most in _limited(wanted):
            assert least <= value <= most, (
                f"{where}: {what} is {value:.4g}, outside of {least:.4g} to {most:.4g}; keep to the specs and the "
                "apertures_m of the setting"
            )


def check_done_moves_nothing(bench: Bench) -> None:
    """The step that is done wants no motion of the arm: the run ends there."""
    for where, wanted in _runs(bench):
        if isinstance(wanted, Wanted) and wanted.done:
            assert not _moves(wanted), f"{where}: done, and it wants {wanted.twist}; end the motion before"


def _runs(bench: Bench) -> Iterator[tuple[str, Any]]:
    """Yield what a job wants in a run of each way to grasp, gripper and arm doing it."""
    for grasp in GRASPS:
        job, world = build(bench), World()
        try:
            job.begin(setting(grasp))
        except ConfigError as error:
            pytest.skip(f"job {bench.name!r} refuses the rig of the kit: {error}")
        while world.t_ns < LONGEST_S * 1e9:
            where = f"grasp {grasp!r}, {world.t_ns * 1e-9:.2f} s"
            wanted = _stepped(job, world, where)
            if wanted is None:
                break
            yield where, wanted[0]
            if not isinstance(wanted[0], Wanted) or wanted[0].done:
                break
            world.follow(wanted[0])


def _stepped(job: Any, world: World, where: str) -> tuple[Any] | None:
    try:
        return (job.step(world.now),)
    except SafetyStop:
        return None
    except Exception as error:
        raise AssertionError(
            f"{where}: step() raised {type(error).__name__}: {error}; raise SafetyStop to end the run as a fault"
        ) from error


def _problem(wanted: Any) -> str:
    if not isinstance(wanted, Wanted):
        return f"step() returned {type(wanted).__name__} {wanted!r}; return a Wanted"
    if not isinstance(wanted.stage, str) or not wanted.stage:
        return f"stage is {wanted.stage!r}; name the stage"
    for name in ("done", "corrects", "probes"):
        if not isinstance(getattr(wanted, name), bool):
            return f"{name} is {getattr(wanted, name)!r}; it must be True or False"
    for name, kind in (("grip", Grip), ("twist", Twist), ("slide", Slide)):
        value = getattr(wanted, name)
        if value is not None and not isinstance(value, kind):
            return f"{name} is {value!r}; it must be a {kind.__name__} or None"
    numbers = [value for _, value, _, _ in _limited(wanted)]
    if not all(map(math.isfinite, numbers)):
        return (
            f"it wants {wanted.grip} and {wanted.twist}, which are not all finite; check what the numbers are made of"
        )
    return ""


def _limited(wanted: Wanted) -> Iterator[tuple[str, float, float, float]]:
    """Yield every number that is limited, with its name and limits."""
    if not isinstance(wanted, Wanted):
        return
    if wanted.grip is not None:
        least_m, most_m = setting().apertures_m
        yield "grip.aperture_m", wanted.grip.aperture_m, least_m, min(most_m, GRIPPER.stroke_m)
        yield "grip.speed_m_s", wanted.grip.speed_m_s, *GRIPPER.speed_m_s
        yield "grip.force_n", wanted.grip.force_n, *GRIPPER.force_n
    if wanted.twist is not None:
        yield "speed of the twist (m/s)", math.hypot(*wanted.twist.linear_m_s), 0.0, ARM.speed_m_s
        yield "rate of the twist (rad/s)", math.hypot(*wanted.twist.angular_rad_s), 0.0, math.pi
        yield "acceleration_m_s2", wanted.acceleration_m_s2, 1e-3, ARM.acceleration_m_s2


def _moves(wanted: Wanted) -> bool:
    return wanted.twist is not None and any((*wanted.twist.linear_m_s, *wanted.twist.angular_rad_s))


JOB_CHECKS = (
    check_first_step_is_answered,
    check_wants_are_sound,
    check_stages_are_declared,
    check_wants_are_within_limits,
    check_done_moves_nothing,
)
