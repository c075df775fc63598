"""The environment of a job: a gripper and an arm that follow its commands, and a gel that shows the touch."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Literal

from lsds.contracts import (
    ABSTAINED,
    ArmSpec,
    ArmState,
    CellTruth,
    Cycle,
    FingerCycle,
    Frame,
    GripperSpec,
    GripperState,
    Pose,
    Setting,
    Situation,
    Twist,
    Wanted,
)
from lsds.contracts.task import TaskOptions
from lsds.testing.gel import Press, draw, grid_px
from lsds.testing.grips import ABSTAINS, TOUCH_M
from lsds.testing.stimulus import FRAME_NS, cycles

JOB_STEP_NS = 8_000_000
"""Interval of the steps of a job, 125 Hz."""
GRIPPER = GripperSpec(stroke_m=0.05, resolution_m=2e-4, speed_m_s=(0.0, 0.15), force_n=(0.0, 130.0))
ARM = ArmSpec(speed_m_s=1.0, acceleration_m_s2=10.0, reach_m=0.85)
FINGERS = ("left", "right")
Grasp = Literal["touch", "aperture"]


class QuietCell:
    """A simulated cell in which nothing slips and nothing drops."""

    def __init__(self) -> None:
        self._t_ns = 0

    def connect(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""

    def advance(self, t_ns: int) -> None:
        """Take a time."""
        self._t_ns = max(self._t_ns, t_ns)

    def truth(self) -> CellTruth:
        """Return a grip that holds."""
        zero = (0.0, 0.0)
        return CellTruth(self._t_ns, zero, zero, 0.0, 0.0, 1.0, 10.0, 1.0, 5.0, TOUCH_M, 0.0, False, False)


def setting(grasp: Grasp = "aperture") -> Setting:
    """Return the setting of a run with gripper, arm and two fingers."""
    task = TaskOptions(grasp="touch") if grasp == "touch" else TaskOptions(grip_aperture_m=TOUCH_M - 1e-3)
    return Setting(0, task, GRIPPER, ARM, QuietCell(), FINGERS, (0.0, GRIPPER.stroke_m))


class World:
    """Follows the commands of a job, step by step. `now` is the situation of the next step."""

    def __init__(self) -> None:
        self.t_ns = 0
        self._aperture_m = self._target_m = GRIPPER.stroke_m
        self._speed_m_s = 0.0
        self._height_m = 0.2
        self._twist = Twist()
        self._seen: tuple[FingerCycle, ...] = ()
        self.now = Situation(0)

    def follow(self, wanted: Wanted) -> None:
        """Advance by a step in which gripper and arm follow the commands."""
        if wanted.grip is not None:
            self._target_m = min(max(wanted.grip.aperture_m, 0.0), GRIPPER.stroke_m)
            self._speed_m_s = wanted.grip.speed_m_s
        self._twist = wanted.twist if wanted.twist is not None else Twist()
        self.advance(self._target_m, self._speed_m_s)

    def advance(self, target_m: float, speed_m_s: float) -> None:
        """Advance by a step in which the fingers move towards an aperture."""
        self.t_ns += JOB_STEP_NS
        step_m = speed_m_s * JOB_STEP_NS * 1e-9
        moving = abs(target_m - self._aperture_m) > step_m
        self._aperture_m += math.copysign(min(step_m, abs(target_m - self._aperture_m)), target_m - self._aperture_m)
        self._height_m += self._twist.linear_m_s[2] * JOB_STEP_NS * 1e-9
        if self.t_ns // FRAME_NS > (self.t_ns - JOB_STEP_NS) // FRAME_NS:
            self._seen = tuple(_seen(name, self.t_ns, self._aperture_m < TOUCH_M) for name in FINGERS)
        seq = self.t_ns // JOB_STEP_NS
        pose = Pose((0.4, 0.0, self._height_m))
        self.now = Situation(
            self.t_ns,
            referenced=self.t_ns > 10 * FRAME_NS,
            arrived=not moving,
            cycle=_cycle(self._seen, self.t_ns, self._aperture_m) if self._seen else None,
            gripper=GripperState(self.t_ns, seq, self._aperture_m, target_m, moving),
            arm=ArmState(self.t_ns, seq, pose, self._twist),
            fingers=self._seen,
        )


@cache
def situations(closing_m_s: float) -> tuple[Situation, ...]:
    """Return the situations of 3 s in which the fingers close on their own, whatever a job wants."""
    world, seen = World(), [Situation(0)]
    for i in range(375):
        world.advance(TOUCH_M - 1e-3 if i > 60 else GRIPPER.stroke_m, closing_m_s)
        seen.append(world.now)
    return tuple(seen)


@cache
def _image(finger: str, touches: bool, seed: int) -> Frame:
    press = Press(depth=0.8) if touches else None
    return Frame(draw(grid_px(), press, seed=1000 + seed + 100 * FINGERS.index(finger)), 0, 0)


def _seen(finger: str, t_ns: int, touches: bool) -> FingerCycle:
    seq = t_ns // FRAME_NS
    # Images differ in their noise; a frame in seven is the same again, which no job notices.
    frame = replace(_image(finger, touches, seq % 7), t_ns=t_ns, seq=seq)
    model = cycles("slides")[8 if touches else 2]
    return replace(
        model,
        finger=finger,
        frame=frame,
        observation=replace(model.observation, t_ns=t_ns, seq=seq, frame=frame),
        tracks=replace(model.tracks, t_ns=t_ns, seq=seq),
        opposite=finger != FINGERS[0],
    )


def _cycle(seen: tuple[FingerCycle, ...], t_ns: int, aperture_m: float) -> Cycle:
    return Cycle(t_ns, "", False, seen, ABSTAINS, ABSTAINED, None, aperture_m, aperture_m)
