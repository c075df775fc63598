"""The engine: one line from camera to gripper, whatever the job.

    sensor -> gate -> tracker -> field -> contact -> features -> detector -> estimator -> controller -> guard -> gripper

`Engine._poll` is that line: `FingerLine` up to the estimate, then `_correct`. Everything else here surrounds it: the
job, the states of gripper and arm, the watchdog, observers. No job, study or collection builds a second line.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from lsds.clock import NS_PER_S, nanoseconds, perf_ns
from lsds.contracts import OBSERVER, Cycle, Grip, GripEstimate, GripTask, Job, Setting, Situation, Twist, Wanted
from lsds.contracts.events import ArmRead, Corrected, FramesRead, GripperRead, JobStepped, PosesRead
from lsds.contracts.stages import SLIP, START
from lsds.errors import CallHangs, ConfigError, ConfigIssue, LsdsError, PluginError, SafetyStop
from lsds.grip.observer import GripObserver
from lsds.runtime.actuation import Actuation
from lsds.runtime.background import Background
from lsds.runtime.device_states import States
from lsds.runtime.finger_pipeline import FingerLine
from lsds.runtime.fusion import fused_detection, fused_estimate
from lsds.runtime.histogram import LogHistogram
from lsds.runtime.observers import Observers
from lsds.runtime.quiet import quiet_process
from lsds.runtime.recorded_frames import all_frames
from lsds.runtime.scheduler import Phase, Scheduler
from lsds.runtime.stop_report import stop_report
from lsds.safety.device_calls import INTERRUPT_SETTLE_S
from lsds.safety.guard import Guard
from lsds.safety.press_watch import PressWatch
from lsds.safety.validation import validated_aperture
from lsds.safety.watchdog import Watchdog
from lsds.tactile.compiled import use_compiled
from lsds.tactile.perception import Perception

if TYPE_CHECKING:
    from lsds.contracts import FingerCycle, Frame
    from lsds.contracts.events import Published
    from lsds.runtime.rig import Rig

B = TypeVar("B")

#: The newest frame is asked for this many times per nominal frame interval: a camera's phase is its own, and a frame
#: that waits for a poll is delay in the loop, which costs more slip than any gain.
POLLS_PER_FRAME = 8
EVENTS = 1024
"""Number of events that may wait for a recorder: some seconds, in which a disk may be busy."""
#: A time that no run reaches, ns: 146 years.
_FOREVER_NS = 2**62


class Engine:
    """Runs a rig through a job, once; the rig is connected and armed, and the caller closes it.

        engine = Engine(rig)              # the job that the config names
        engine.run()                      # to its end, or
        for cycle in engine: ...          # step by step; the body runs in the loop's own time, or
        with engine.background(): ...     # next to another program (real time only)

    However it ends, `stop` of arm and gripper is called, and the grip is kept. `stop_report`, also a note of the error
    that ended the run, states what is known of them. Raises SafetyStop, DeviceError, DataError, PluginError.
    """

    def __init__(self, rig: Rig, job: Job | None = None, *, observers: Observers[Cycle] | None = None) -> None:
        config = rig.config
        self._rig = rig
        self._job = job if job is not None else rig.job
        self.job_name = config.section("job").backend if job is None else type(job).__name__
        self._job_label = f"job '{self.job_name}'"
        self._controller_name = f"controller '{config.section('controller').backend}'"
        self.observers: Observers[Cycle] = observers if observers is not None else Observers(threaded=False)
        # Everything that results depend on, for a recorder: a slow one loses events and never delays the loop.
        self.events: Observers[Published] = Observers(threaded=not rig.virtual, queue=EVENTS)
        self._clock = rig.clock
        self._safety = config.safety
        self._fragile_n = math.inf if config.task.fragile_n is None else config.task.fragile_n
        start = rig.clock.now()
        self._recorded = rig.is_recording
        self.lines = tuple(FingerLine(finger, rig, start, live=not self._recorded) for finger in rig.fingers)
        # A recording is read frame by frame: nothing waits for it.
        for line in () if self._recorded else self.lines:
            _require_rate(line, config.safety.stale_after_s)
        self._calls = rig.thread.calls
        self._update = rig.deadlines.of(self._controller_name, "update")
        self._step = rig.deadlines.of(self._job_label, "step")
        self._consent = _Consent()
        self._act = Actuation(rig.gripper, rig.arm, config, rig.clock, self._consent.ask, self._calls)
        self._controls = config.controller.enabled and rig.gripper is not None
        self._may_open = bool(getattr(rig.controller, "may_open", False))
        if self._controls and math.isfinite(self._fragile_n) and not getattr(rig.controller, "limits_force", False):
            problem = f"{self._controller_name} does not support task.fragile_n: a fragile object would be crushed"
            raise ConfigError(
                "the rig", [ConfigIssue("task.fragile_n", problem, 'choose controller.backend = "belief"')]
            )
        self._states = States(rig, start)
        self._asked = GripTask(
            fragile_n=self._fragile_n,
            resolution_m=0.0 if rig.gripper is None else rig.gripper.spec.resolution_m,
            answer_s=_answer_s(rig) if config.grip.answer_s is None else config.grip.answer_s,
        )
        compiled = use_compiled(config.tactile.arithmetic)
        self._grip = GripObserver(config.grip, self._asked.answer_s, compiled=compiled)
        self._press = PressWatch(config.grip.power, self._asked.resolution_m)
        self._watches_press = self._controls and config.safety.watch_press
        self._newest: Cycle | None = None
        self._wanted = Wanted("begin")
        self._controlled_ns: int | None = None
        self._began = self._ended = False
        self.recorded = 0
        self.stop_report = ""
        self.held_back_frames = 0
        self.slip_wanted = False
        self.on_recorded: Callable[[Frame], object] | None = None
        self.acting_since_ns: int | None = None
        self._yielding: deque[Cycle] | None = None
        self.frame_to_command = LogHistogram()
        self.scheduler = Scheduler(rig.clock)
        for at, (section, fault) in enumerate(rig.faults):
            if fault.target == OBSERVER:
                self.observers.add(f"fault {at + 1}, {section.backend}", fault.around(None))
        self._add_tasks()

    # -- what can be asked of it --------------------------------------------------------------------------

    @property
    def rig(self) -> Rig:
        """The rig that it runs."""
        return self._rig

    @property
    def job(self) -> Job:
        """The job of the run."""
        return self._job

    @property
    def stage(self) -> str:
        """The present stage of the job."""
        return self._wanted.stage

    @property
    def done(self) -> bool:
        """Whether the job is done."""
        return self._wanted.done

    @property
    def released(self) -> bool:
        """Whether the job has released the object: its last wanted grip was an opening."""
        return self._act.opened

    @property
    def pose_problem(self) -> str:
        """The reason why the pose source delivers no poses, "" while it does."""
        return self._states.pose_problem

    @property
    def grips(self) -> bool:
        """Whether there is a gripper."""
        return self._rig.gripper is not None

    @property
    def perception(self) -> Perception:
        """The first finger's way from image to observation."""
        return self.lines[0].perception

    @property
    def guard(self) -> Guard:
        """The limits, with counts of what they changed."""
        return self._act.guard

    @property
    def unusable_frames(self) -> int:
        """Frames of all fingers that the gate refused."""
        return sum(line.gate.refused for line in self.lines)

    def every(self, name: str, call: Callable[[int], object], rate_hz: float) -> None:
        """Have `call(now_ns)` called at a rate, after all else that is due then. An exception ends the run.

        Raises ConfigError for a rate that is not positive, and on a recording, where no clock runs.
        """
        if self._recorded or not rate_hz > 0:
            problem = "a recording has no clock" if self._recorded else f"{rate_hz:g} Hz is not a rate"
            raise ConfigError("the engine", [ConfigIssue(f"every('{name}')", problem, "use an observer")])
        self.scheduler.add(name, call, _period(rate_hz), phase=Phase.OBSERVE)

    # -- three ways to run --------------------------------------------------------------------------------

    def run(self) -> None:
        """Run until the job is done, the recording ends, or `stop` is called."""
        with self._attended():
            self._within(self._to_the_end)

    def __iter__(self) -> Generator[Cycle]:
        """Run, yielding each cycle. Leaving the loop stops the cell; a slow body trips the watchdog."""
        self._yielding = deque()
        with self._attended():
            more = True
            while more:
                more = self._within(self._advance)
                while self._yielding:
                    yield self._yielding.popleft()

    @contextmanager
    def background(self) -> Iterator[Background]:
        """Run in a separate thread while the body runs; leaving the body ends the run, and raises its error.

        Real time only: raises ConfigError under the virtual clock, which only advances when it is stepped.
        """
        if self._rig.virtual:
            issue = ConfigIssue(
                "clock", "the virtual clock cannot run next to another program", "iterate over the engine"
            )
            raise ConfigError("the rig", [issue])
        running = Background(self)
        running.start()
        try:
            yield running
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                self._rig.hurry()
                if not running.end(INTERRUPT_SETTLE_S):
                    self._leave()
            else:
                running.end()
            running.add_note_to(error)
            raise
        running.end()
        running.check()

    def stop(self) -> None:
        """End the run before the next task starts; from any thread."""
        self._ended = True
        self.scheduler.stop()

    # -- the line from camera to gripper ------------------------------------------------------------------

    def _poll(self, now_ns: int) -> None:
        """Take every finger's new frame, if there is one, all the way to the gripper."""
        try:
            read = [(line, line.read(now_ns)) for line in self.lines]
        except EOFError:
            self.stop()
            return
        started = perf_ns()
        # Only what an object or a moving arm depends on may stop the cell for showing nothing new.
        wanted = self._wanted
        depends = (wanted.corrects and self._rig.gripper is not None) or _moves(wanted.twist)
        self._see([(line, frame) for line, frame in read if frame is not None], now_ns, started, depends=depends)

    def _see(self, new: Sequence[tuple[FingerLine, Frame]], now_ns: int, started: int, *, depends: bool) -> None:
        """Take new frames all the way to the gripper."""
        if new and self.events.used:
            frames = tuple((line.finger.name, frame) for line, frame in new)
            # A recorder compresses the images when the answer to them has been sent.
            self.events.publish(FramesRead(now_ns, frames, depends), wake=False)
        seeing = [line for line, frame in new if line.take(frame, now_ns, depends=depends) is not None]
        if seeing:
            self._answer(seeing, now_ns, started)

    def _answer(self, seeing: Sequence[FingerLine], now_ns: int, started: int) -> None:
        """Decide on what the fingers have just seen, send, publish."""
        seen = tuple(line.newest for line in seeing if line.newest is not None)
        known = self._known(seen)
        detection, estimate = fused_detection(known), fused_estimate(known)
        acting = self._wanted.corrects
        state = self._states.gripper
        measured = math.nan if state is None else state.aperture_m
        first = seen[0].observation
        grip = GripEstimate(
            t_ns=first.t_ns,
            dt_s=self._since_controlled(seen[0]) if acting else first.dt_s,
            detection=detection,
            estimate=estimate,
            fingers=known,
            # Where a job has gripped nothing itself, the fingers are where they are.
            commanded_m=self._act.held_m if math.isfinite(self._act.held_m) else measured,
            measured_m=measured,
            aperture_m=self._aperture_at(first.t_ns),
            touch_m=self._wanted.touch_m,
        )
        if acting or self._rig.gripper is None:
            grip = self._grip.update(
                grip,
                supported=self._wanted.supported,
                speed_m_s=_speed_m_s(self._wanted.twist),
                touch_std_m=self._wanted.touch_std_m,
            )
        if acting and grip.sliding:
            self._rig.stages.enter(SLIP, now_ns)
        command = None
        if acting and self._controls and state is not None:
            command = self._correct(grip, now_ns)
        self.frame_to_command.add((perf_ns() - started,))
        self._newest = cycle = Cycle(
            now_ns,
            self._wanted.stage,
            acting,
            seen,
            detection,
            estimate,
            command,
            self._act.held_m,
            measured,
            self._states.pose,
            self._wanted.twist,
            leads=seeing[0] is self.lines[0],
            grip=grip,
        )
        self.observers.publish(cycle)
        self.events.publish(cycle)
        # After the cycle is published, so that a recording has the frame that explains a stop.
        if self._watches_press and acting and grip.complete and math.isfinite(self._wanted.touch_m):
            noticed_m, std_m = self._wanted.touch_m, self._wanted.touch_std_m
            self._press.see(grip, noticed_m - grip.aperture_m, std_m)
        if self._yielding is not None:
            self._yielding.append(cycle)
            self.scheduler.stop()
        for line, finger in zip(seeing, seen, strict=True):
            line.gate.followed(finger.frame, finger.tracks, now_ns)

    def _correct(self, grip: GripEstimate, now_ns: int) -> float | None:
        """Ask the controller for an aperture and send it; return what was sent, None for nothing."""
        wanted = replace(self._asked, probes=self._wanted.probes, slide=self._wanted.slide)
        aperture = self._calls.named(self._update, self._rig.controller.update, grip, wanted)
        aperture = validated_aperture(self._controller_name, aperture)
        self.held_back_frames += bool(getattr(self._rig.controller, "held_back", False))
        if aperture is None:
            return None
        # Whatever the controller asks for, nothing is opened on an abstention or on a load that is not measured now.
        sees = grip.detection.slip is not None and not grip.stale
        may_open = self._may_open and sees and self._states.is_recent(self._clock.now())
        sent = self._act.correct(aperture, may_open=may_open)
        self.events.publish(Corrected(now_ns, aperture, sent))
        return sent

    def _aperture_at(self, t_ns: int) -> float:
        """Return the aperture (m) at a time, the newest where that is not known, NaN before the first state."""
        aperture_m, state = self._states.aperture_at(t_ns), self._states.gripper
        return aperture_m if math.isfinite(aperture_m) or state is None else state.aperture_m

    def _since_controlled(self, finger: FingerCycle) -> float:
        """Return the time (s) since the controller's last update, measured by frames.

        One finger's own interval will do; with several, each frame would count a whole interval.
        """
        seen = finger.observation
        last, self._controlled_ns = self._controlled_ns, seen.t_ns
        return seen.dt_s if len(self.lines) == 1 or last is None else (seen.t_ns - last) * 1e-9

    def _known(self, seen: tuple[FingerCycle, ...]) -> tuple[FingerCycle, ...]:
        """Return the newest cycle of each finger that is not too old to count."""
        if len(self.lines) == 1:
            return seen
        latest = max(finger.observation.t_ns for finger in seen)
        oldest = latest - nanoseconds(self._safety.stale_after_s)
        newest = [line.newest for line in self.lines if line.newest is not None]
        return tuple(finger for finger in newest if finger.observation.t_ns >= oldest)

    # -- what surrounds it --------------------------------------------------------------------------------

    def _add_tasks(self) -> None:
        rig, schedule = self._rig, self._rig.config.schedule
        add = self.scheduler.add
        if rig.gripper is not None:
            add("gripper", self._read_gripper, _period(schedule.gripper_rate_hz), phase=Phase.READ)
        if rig.arm is not None:
            add("arm", self._read_arm, _period(schedule.gripper_rate_hz), phase=Phase.READ)
        if rig.pose_source is not None:
            add("pose", self._read_pose, _period(schedule.pose_rate_hz), phase=Phase.READ)
        rate = max(finger.sensor.spec.rate_hz for finger in rig.fingers)
        add("sensor", self._poll, _period(rate * POLLS_PER_FRAME), phase=Phase.TRACK)
        add("job", self._do_job, _period(schedule.arm_rate_hz), phase=Phase.COMMAND)

    def _read_gripper(self, now_ns: int) -> None:
        before = self._states.gripper
        self._states.read_gripper(now_ns)
        state = self._states.gripper
        if state is not None and state is not before:
            self.events.publish(GripperRead(now_ns, state))
        self._act.watch(state, now_ns)

    def _read_arm(self, now_ns: int) -> None:
        before = self._states.arm
        self._states.read_arm(now_ns, Twist() if self._wanted.twist is None else self._act.moving)
        state = self._states.arm
        if state is not None and state is not before:
            self.events.publish(ArmRead(now_ns, state))

    def _read_pose(self, now_ns: int) -> None:
        before = self._states.pose, self._states.pose_problem
        self._states.read_pose(now_ns)
        now = self._states.pose, self._states.pose_problem
        if now[0] is not before[0] or now[1] != before[1]:
            self.events.publish(PosesRead(now_ns, *now))

    def _do_job(self, now_ns: int) -> None:
        """Ask the job what it wants, and send that."""
        if self._consent.watchdog is not None:
            self._consent.watchdog.feed()
            self._consent.watchdog.check()
        situation = Situation(
            now_ns,
            referenced=all(line.referenced for line in self.lines),
            arrived=self._act.arrived(self._states.gripper, now_ns),
            cycle=self._newest,
            gripper=self._states.gripper,
            arm=self._states.arm,
            pose=self._states.pose,
            fingers=tuple(line.newest for line in self.lines if line.newest is not None),
        )
        wanted = self._calls.named(self._step, self._job.step, situation)
        self._require_sound(wanted)
        before = self._wanted
        self._adopt(wanted, now_ns)
        if wanted.done:
            self.events.publish(JobStepped(now_ns, wanted, False, self._act.held_m))
            self.stop()
            return
        sent = self._act.grip(wanted.grip, self._states.gripper, now_ns)
        if wanted.corrects:
            # A corrected grip holds an object: an earlier opening was a part of the grasp.
            self._act.opened = False
        if sent or _differ(wanted, before):
            self.events.publish(JobStepped(now_ns, wanted, sent, self._act.held_m))
        if sent or (wanted.corrects and not before.corrects):
            self._begin_grip()
        elif (wanted.touch_m, wanted.touch_std_m) != (before.touch_m, before.touch_std_m):
            self._press.reset()
        if wanted.twist is not None:
            self._act.move(wanted.twist, wanted.acceleration_m_s2)

    def _adopt(self, wanted: Wanted, now_ns: int) -> None:
        """Make a job's wishes the present ones."""
        self._rig.stages.enter(wanted.stage, now_ns)
        self._wanted = wanted
        self.slip_wanted |= wanted.slide is not None
        if wanted.corrects and self.acting_since_ns is None:
            self.acting_since_ns = now_ns

    def _begin_grip(self) -> None:
        """Forget the grip before: the controller's memory belongs to it."""
        self._grip.reset()
        self._press.reset()
        self._calls.named(self._update._replace(name="reset"), self._rig.controller.reset)
        self._controlled_ns = None

    def _require_sound(self, wanted: object) -> None:
        """Raise PluginError, naming job and stage, before anything of a malformed wish is sent."""
        if not isinstance(wanted, Wanted):
            raise PluginError(f"{self._job_label}: step() returned {type(wanted).__name__}, not Wanted")
        problem = ""
        if not isinstance(wanted.grip, Grip | None):
            problem = f"grip is {wanted.grip!r}, not a Grip"
        elif not isinstance(wanted.twist, Twist | None):
            problem = f"twist is {wanted.twist!r}, not a Twist"
        else:
            grip, twist = wanted.grip, wanted.twist
            numbers: list[float] = [] if grip is None else [grip.aperture_m, grip.speed_m_s, grip.force_n]
            if twist is not None:
                numbers += [*twist.linear_m_s, *twist.angular_rad_s, wanted.acceleration_m_s2]
            if wanted.slide is not None:
                numbers += [wanted.slide.speed_m_s, wanted.slide.rate_rad_s]
            if not all(map(math.isfinite, numbers)):
                problem = f"it wants {wanted.grip}, {wanted.twist}, {wanted.slide}, which are not all finite numbers"
            elif math.isfinite(wanted.touch_m) and not 0 <= wanted.touch_std_m < math.inf:
                problem = f"touch_std_m is {wanted.touch_std_m}, not a length of 0 or more"
        if problem:
            raise PluginError(f"{self._job_label}: stage '{wanted.stage}': {problem} (a mistake in that job)")

    def _advance(self) -> bool:
        """Run until there is a cycle to yield, or to the end; return whether there is more."""
        if self._ended:
            return False
        if self._recorded:
            return self._next_recorded()
        self.scheduler.run(_FOREVER_NS)
        return not self._ended

    def _to_the_end(self) -> None:
        while self._advance():
            pass

    def _within(self, function: Callable[[], B]) -> B:
        """Run a function in the cell's thread, so that a call that hangs can be left; a recording has no devices."""
        if self._recorded:
            return function()
        try:
            return self._rig.thread.run(function, leave=self._leave)
        except KeyboardInterrupt:
            self._rig.hurry()
            raise

    def _leave(self) -> None:
        """End the run without waiting for the call in progress; should it ever return, it may send nothing."""
        self._consent.left = True
        self.stop()

    @contextmanager
    def _attended(self) -> Iterator[None]:
        """Begin and end the run in the cell's thread, around a body in the caller's."""
        running = self._running()
        self._within(running.__enter__)
        try:
            yield
        except BaseException as error:
            self._within(partial(running.__exit__, type(error), error, error.__traceback__))
            raise
        self._within(partial(running.__exit__, None, None, None))

    @contextmanager
    def _running(self) -> Iterator[None]:
        """Begin the job; whatever ends it, the cell is stopped."""
        if self._began:
            raise RuntimeError("this engine has run; build a new one")
        self._began = True
        failure: BaseException | None = None
        self._rig.stages.enter(START, self._clock.now())
        try:
            setting = Setting(
                self._clock.now(),
                self._rig.config.task,
                None if self._rig.gripper is None else self._rig.gripper.spec,
                None if self._rig.arm is None else self._rig.arm.spec,
                self._rig.own_cell,
                tuple(finger.name for finger in self._rig.fingers),
                self._rig.config.safety.apertures_m,
            )
            for line in self.lines:
                line.reset()
            self._calls.named(self._step._replace(name="begin"), self._job.begin, setting)
            with quiet_process():
                if self._recorded:
                    self._frames = all_frames(self.lines, self._clock.now())
                if self._rig.virtual:
                    yield
                    return
                with Watchdog(self._rig.stop, self._safety.watchdog_s, self._clock.now, self._doing) as watchdog:
                    self._consent.watchdog = watchdog
                    try:
                        yield
                    except CallHangs:
                        raise  # It is more specific than the watchdog's error.
                    except LsdsError as error:
                        # If the watchdog has stopped the cell, that is the cause of this error.
                        watchdog.check(error)
                        raise
                    watchdog.check()
        except GeneratorExit:
            raise
        except BaseException as error:
            failure = error
            raise
        finally:
            self._consent.watchdog = None
            self._yielding = None
            # The tasks hold the engine, which holds them: without this, a run's frames wait for the garbage collector.
            self.scheduler.clear()
            now = self._clock.now()
            problems = self._rig.stop()
            if failure is not None:
                self.stop_report = stop_report(failure, self._rig, self._states, self._act, problems, now)
                if self.stop_report:
                    failure.add_note(self.stop_report)
                # A traceback holds this frame, which must not hold the traceback.
                failure = None

    def _doing(self) -> str:
        """Return the call in progress, "" between calls."""
        call = self._calls.at
        return "" if call is None else f"{call.name}() of {call.who}"

    # -- a recording, frame by frame ----------------------------------------------------------------------

    def _next_recorded(self) -> bool:
        item = next(self._frames, None)
        if item is None:
            self._ended = True
            return False
        frame, line = item
        self.recorded += 1
        self._clock.sleep_until(frame.t_ns)
        now = self._clock.now()
        self._see([(line, frame)], now, perf_ns(), depends=False)
        self._do_job(now)
        if self.on_recorded is not None:
            self.on_recorded(frame)
        return not self._ended


class _Consent:
    """Whether commands may still be sent. It does not hold the engine: a reference cycle through the engine would keep
    the memory of a run until the garbage collector comes."""

    def __init__(self) -> None:
        self.left = False
        self.watchdog: Watchdog | None = None

    def ask(self) -> None:
        """Raise SafetyStop where the run was left, or the watchdog has stopped the cell."""
        if self.left:
            raise SafetyStop("the run was ended while a call was in progress; nothing more is sent")
        if self.watchdog is not None:
            self.watchdog.check()


def _differ(one: Wanted, other: Wanted) -> bool:
    """Return whether two wishes differ; a job may give a twist as arrays, which have no single answer."""
    try:
        return one != other
    except ValueError:
        return True


def _moves(twist: Twist | None) -> bool:
    return twist is not None and (any(twist.linear_m_s) or any(twist.angular_rad_s))


def _speed_m_s(twist: Twist | None) -> float:
    """Return how fast a job moves the arm; infinite if it leaves the arm alone."""
    return math.inf if twist is None else math.hypot(*twist.linear_m_s)


def _answer_s(rig: Rig) -> float:
    """Return the time (s) from a change at the object to the fingers' answer: until it is in a frame at the latest,
    until the frame is here, and until the fingers move."""
    sensor_s = max(1 / finger.sensor.spec.rate_hz + finger.sensor.spec.latency_s for finger in rig.fingers)
    return sensor_s + (0.0 if rig.gripper is None else rig.gripper.spec.latency_s)


def _require_rate(line: FingerLine, stale_after_s: float) -> None:
    """Raise ConfigError where a healthy sensor would count as stale between two frames."""
    rate_hz = line.finger.sensor.spec.rate_hz
    if 2 / rate_hz > stale_after_s:
        issue = ConfigIssue(
            "safety.stale_after_s",
            f"{stale_after_s:g} s is less than two frames of a sensor at {rate_hz:g} Hz",
            f"at least {2 / rate_hz:.3g}",
        )
        raise ConfigError("the rig", [issue])


def _period(rate_hz: float) -> int:
    return max(1, round(NS_PER_S / rate_hz))
