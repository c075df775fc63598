"""Job `lift`, the paper's demonstration: take the reference, grasp, settle, lift, hold."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace

from lsds.clock import nanoseconds
from lsds.contracts import BuildContext, Setting, Situation, Twist, Wanted
from lsds.jobs.grasp import GRASP_STAGES, begin_grasp
from lsds.jobs.probe import PROBE_LIFT_M_S, Probe
from lsds.jobs.take_up import TakeUp

MOST_WAIT_S = 3.0
"""Maximum total time that the arm waits for the fingers, s; chosen: a controller need not hold the object, but a run
must end."""
Stage = Generator[Wanted, Situation, Situation]
"""A stage yields what it wants, is sent the situation then, and returns the situation that ends it."""


class LiftJob:
    """A `Job` in stages: reference, grasp, settle, lift, hold. Slip is corrected in the last two.

    After a grasp by touch the lift begins slowly, until the load is taken up; what that rises counts as lifted. With
    `task.probe` the controller looks for the least grip then.

    In a simulated cell it ends when the object has dropped. Its options are in `[task]`.
    """

    stages = ("begin", *GRASP_STAGES, "settle", "take up", "probe", "lift", "hold", "done")

    def __init__(self, options: None = None, context: BuildContext | None = None) -> None: ...

    def begin(self, setting: Setting) -> None:
        """Start with the gel without contact."""
        self._cell = setting.cell
        self._stages = _Lift(setting).stages()
        next(self._stages)

    def step(self, now: Situation) -> Wanted:
        """Return the wanted motion and grip. Raises SafetyStop if reference or grasp takes too long."""
        try:
            wanted = self._stages.send(now)
        except StopIteration:
            return Wanted("done", done=True)
        return replace(wanted, done=self._dropped(now.t_ns))

    def _dropped(self, now_ns: int) -> bool:
        if self._cell is None:
            return False
        self._cell.advance(now_ns)
        return self._cell.truth().dropped


class _Lift:
    """The stages of one lift. The job holds them, and they do not hold the job: a run that ends within a stage would
    wait for the garbage collector, with its cell."""

    def __init__(self, setting: Setting) -> None:
        self._task = setting.task
        self._by_touch = setting.task.grasp == "touch" and setting.gripper is not None
        self._grasp = begin_grasp(setting.task, setting)
        self._touch_m = self._touch_std_m = math.nan
        self._hangs = False
        self._left_s = setting.task.lift_s
        self._waited_ns = 0

    def stages(self) -> Stage:
        """Yield the wanted motion and grip, from the reference to the end of the hold."""
        task, grasp = self._task, self._grasp
        now = yield Wanted("begin")
        while not grasp.step(now):
            now = yield Wanted(grasp.stage, grip=grasp.grip)
        self._touch_m, self._touch_std_m = grasp.touch_m, grasp.touch_std_m
        now = yield from self._timed(Wanted("settle"), task.settle_s, now)
        if self._by_touch and task.lift_s > 0 and task.lift_speed_m_s > 0:
            if task.probe:
                now = yield from self._take_up(min(PROBE_LIFT_M_S, task.lift_speed_m_s), now)
                # The probe opens the fingers only if the object hangs, just above its support.
                if self._hangs:
                    now = yield from self._probe(now)
            if task.take_up_speed_m_s < task.lift_speed_m_s:
                now = yield from self._take_up(task.take_up_speed_m_s, now)
        now = yield from self._timed(self._rising("lift", task.lift_speed_m_s), self._left_s, now)
        return (yield from self._timed(self._rising("hold", 0.0), task.hold_s, now))

    def _timed(self, wanted: Wanted, duration_s: float, now: Situation) -> Stage:
        ends_ns = now.t_ns + nanoseconds(duration_s)
        while True:
            now = yield wanted
            if now.t_ns >= ends_ns:
                return now

    def _take_up(self, speed_m_s: float, now: Situation) -> Stage:
        """Rise slowly until the object hangs, at most as far as it is to be lifted."""
        share = speed_m_s / self._task.lift_speed_m_s
        take_up, began_ns, left_s = TakeUp(now.t_ns), now.t_ns, self._left_s
        while True:
            waits = _slips(now) and self._waited_ns < nanoseconds(MOST_WAIT_S)
            before_ns = now.t_ns
            now = yield replace(self._rising("take up", 0.0 if waits else speed_m_s), supported=True)
            if waits:
                self._waited_ns += now.t_ns - before_ns
                began_ns += now.t_ns - before_ns
                take_up.wait(now.t_ns - before_ns)
            self._left_s = max(0.0, left_s - share * (now.t_ns - began_ns) * 1e-9)
            if self._left_s == 0 or take_up.step(now):
                self._hangs = take_up.has_load
                return now

    def _probe(self, now: Situation) -> Stage:
        probe = Probe(now.t_ns)
        while not probe.step(now):
            now = yield replace(self._rising("probe", 0.0), probes=True)
        return now

    def _rising(self, stage: str, speed_m_s: float) -> Wanted:
        return Wanted(
            stage,
            corrects=True,
            twist=Twist(linear_m_s=(0.0, 0.0, speed_m_s)),
            acceleration_m_s2=self._task.lift_acceleration_m_s2,
            touch_m=self._touch_m,
            touch_std_m=self._touch_std_m,
        )


def _slips(now: Situation) -> bool:
    """Return whether the object probably slides, so that the arm should wait for the fingers."""
    return now.cycle is not None and now.cycle.grip.sliding
