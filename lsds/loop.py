"""The loop: one frame from camera to gripper, while the arm does the job.

    sensor.read -> tracker -> field -> contact -> features -> detector -> estimator -> controller -> guard -> gripper

`Loop.on_frame` is that line, in that order. Everything else here is what surrounds it: the job's stages, the arm's
velocity stream, stale sensing, observers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds.clock import NS_PER_S, nanoseconds, perf_ns
from lsds.collector import quiet_collector
from lsds.contracts import ArmCommand, GripInput, GripperCommand, Twist
from lsds.errors import CommandExpired, ConfigError, ConfigIssue, DataError, StaleData
from lsds.histogram import LogHistogram
from lsds.safety import Guard, Watchdog
from lsds.scheduler import Phase, Scheduler
from lsds.tactile.perception import Perception
from lsds.tactile.reference import ReferenceCollector
from lsds.task import LiftTask, Stage
from lsds.truth_log import TruthLog
from lsds.vigilance import FollowWatch, Freshness, GraspWatch, RepeatedImage

if TYPE_CHECKING:
    from lsds.contracts import (
        CellTruth,
        Detection,
        Frame,
        GripperState,
        MarkerTracks,
        Observation,
        PoseSample,
        SlipEstimate,
    )
    from lsds.observers import Observers
    from lsds.rig import Rig

#: The newest frame is asked for this many times per nominal frame interval: a camera's phase is its own, and a frame
#: that waits for a poll is delay in the loop, which costs more slip than any gain.
POLLS_PER_FRAME = 8
#: Time that a camera may take for its first frame, s.
FIRST_FRAME_S = 3.0
#: With fewer of its dots followed than this share, a gel is as good as not seen.
BLIND_SHARE = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """What one frame brought about; observers get one a frame. `command_m` is None where nothing was sent."""

    t_ns: int
    stage: Stage
    frame: Frame
    tracks: MarkerTracks
    observation: Observation
    detection: Detection
    estimate: SlipEstimate
    command_m: float | None
    held_m: float
    measured_m: float
    truth: CellTruth | None
    pose: PoseSample | None = None


class Loop:
    """Runs a rig through a job. The rig is connected and armed; the caller closes it."""

    def __init__(self, rig: Rig, observers: Observers[Cycle]) -> None:
        config = rig.config
        _require_rate(rig.sensor.spec.rate_hz, config.safety.stale_after_s)
        self._rig = rig
        self._observers = observers
        self._clock = rig.clock
        self.perception = Perception(rig.tracker, rig.sensor.spec, config.tactile)
        self._guard = Guard(config.safety)
        self._safety = config.safety
        self._lifetime_ns = nanoseconds(config.safety.command_lifetime_s)
        self._controls = config.controller.enabled and rig.gripper is not None
        self._may_open = bool(getattr(rig.controller, "may_open", False))
        start = self._start_ns = rig.clock.now()
        stale = nanoseconds(config.safety.stale_after_s)
        self._task = LiftTask(config.task, start)
        self._reference = ReferenceCollector(config.tactile.reference_frames)
        self._sensor_fresh = Freshness(
            "sensor", start, stale, allowance_ns=nanoseconds(FIRST_FRAME_S), remedy="check the sensor and its cable"
        )
        self._gripper_fresh = Freshness("gripper", start, stale, remedy="check the gripper and its cable")
        self._arm_fresh = Freshness("arm", start, stale, remedy="check the arm's connection")
        self._image_fresh = Freshness(
            "sensor", start, nanoseconds(config.safety.frozen_after_s), remedy="the camera repeats one image"
        )
        self._repeated = RepeatedImage()
        self._grasp = GraspWatch(rig.gripper.spec.resolution_m if rig.gripper is not None else 0.0)
        self._follow = FollowWatch()
        self._seen_seq = -1
        self._gripper_state: GripperState | None = None
        self._pose: PoseSample | None = None
        self._held_m = math.nan
        self._watchdog: Watchdog | None = None
        # A recording or a real sensor has nothing to do with what a simulated pipe does beside it.
        specs = {kind: backend.spec for kind, backend in rig.backends.items()}
        lives_in_cell = ("sensor" in specs and specs["sensor"].in_cell) or ("cell" in specs and specs["cell"].over_wire)
        self.truth = TruthLog(rig.cell if lives_in_cell else None, config.schedule.arm_rate_hz)
        self.unusable_frames = 0
        self.frame_to_command = LogHistogram()
        self.scheduler = Scheduler(rig.clock)
        self._add_tasks()

    @property
    def task(self) -> LiftTask:
        """The job."""
        return self._task

    @property
    def guard(self) -> Guard:
        """The limits, with counts of what they changed."""
        return self._guard

    def run(self) -> None:
        """Run the job to its end, until the object has dropped, or until the recording ends.

        Raises SafetyStop, DeviceError, DataError; the cell is stopped in each case.
        """
        longest = self._task.options
        horizon = 2 * longest.timeout_s + longest.settle_s + longest.lift_s + longest.hold_s
        until = self._start_ns + nanoseconds(horizon)
        try:
            with quiet_collector():
                if self._rig.virtual:
                    self.scheduler.run(until)
                    return
                with Watchdog(self._rig.stop, self._safety.watchdog_s, self._clock.now) as self._watchdog:
                    self.scheduler.run(until)
                    self._watchdog.check()
        finally:
            self._rig.stop()

    # -- the line from camera to gripper ------------------------------------------------------------------

    def on_frame(self, frame: Frame, now_ns: int) -> None:
        """Take one new frame all the way to the gripper."""
        started = perf_ns()
        observation, tracks = self.perception.observe(frame)
        detection = self._rig.detector.update(observation)
        estimate = self._rig.estimator.update(observation)
        command = self._correct(observation, detection, estimate)
        self.frame_to_command.add((perf_ns() - started,))
        measured = math.nan if self._gripper_state is None else self._gripper_state.aperture_m
        self._observers.publish(
            Cycle(
                now_ns,
                self._task.stage,
                frame,
                tracks,
                observation,
                detection,
                estimate,
                command,
                self._held_m,
                measured,
                self.truth.at(frame.t_ns),
                self._pose,
            )
        )
        share = float(np.count_nonzero(tracks.valid)) / len(tracks.valid)
        if share >= BLIND_SHARE:
            self._sensor_fresh.good(now_ns)
        else:
            self._unusable(f"frame {frame.seq}: only {100 * share:.0f} % of the dots can be followed", now_ns)

    def _correct(self, observation: Observation, detection: Detection, estimate: SlipEstimate) -> float | None:
        """Ask the controller; send what the guard lets through. Return the aperture really sent."""
        gripper, state = self._rig.gripper, self._gripper_state
        if not (self._controls and self._task.corrects_grip) or gripper is None or state is None:
            return None
        wanted = self._rig.controller.update(
            GripInput(observation.t_ns, observation.dt_s, detection, estimate, self._held_m, state.aperture_m)
        )
        if wanted is None:
            return None
        return self._send_aperture(wanted, allow_opening=self._may_open)

    def _send_aperture(self, aperture_m: float, *, allow_opening: bool) -> float | None:
        gripper, task = self._rig.gripper, self._task.options
        if gripper is None:
            return None
        stroke = gripper.spec.stroke_m
        aperture_m = min(max(aperture_m, 0.0), stroke) if math.isfinite(aperture_m) else aperture_m
        # The command lives from when it is sent, not from when its frame came.
        expires = self._clock.now() + self._lifetime_ns
        command = GripperCommand(aperture_m, task.grip_speed_m_s, task.grip_force_n, expires)
        held = self._held_m if math.isfinite(self._held_m) else stroke
        try:
            sent = gripper.command(self._guard.gripper(command, held, allow_opening=allow_opening))
        except CommandExpired:
            # The grip stays as it is; the next frame decides anew.
            return None
        self._held_m = sent.aperture_m
        return sent.aperture_m

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
        add("sensor", self._poll_sensor, _period(rig.sensor.spec.rate_hz * POLLS_PER_FRAME), phase=Phase.TRACK)
        add("job", self._do_job, _period(schedule.arm_rate_hz), phase=Phase.COMMAND)

    def _read_gripper(self, now_ns: int) -> None:
        gripper, fresh = self._rig.gripper, self._gripper_fresh
        if gripper is None:
            return
        try:
            state = gripper.read()
        except StaleData as error:
            fresh.bad(str(error))
        else:
            if fresh.stamped(state.t_ns, now_ns):
                self._gripper_state = state
                fresh.good(now_ns)
        fresh.require(now_ns)

    def _read_arm(self, now_ns: int) -> None:
        arm, fresh = self._rig.arm, self._arm_fresh
        if arm is None:
            return
        try:
            state = arm.read()
        except StaleData as error:
            fresh.bad(str(error))
        else:
            if fresh.stamped(state.t_ns, now_ns):
                fresh.good(now_ns)
                self._follow.check(state, self._task.lift_speed_m_s, now_ns)
        fresh.require(now_ns)

    def _read_pose(self, now_ns: int) -> None:
        """Take the newest poses; they are for observers, so that going without stops nothing."""
        if self._rig.pose_source is not None:
            try:
                self._pose = self._rig.pose_source.read()
            except StaleData:
                self._pose = None

    def _poll_sensor(self, now_ns: int) -> None:
        try:
            frame = self._rig.sensor.read()
        except EOFError:
            self.scheduler.stop()
            return
        except StaleData as error:
            self._sensor_fresh.bad(str(error))
        except DataError as error:
            self._unusable(str(error), now_ns)
        else:
            if frame.seq != self._seen_seq:
                self._seen_seq = frame.seq
                self._take(frame, now_ns)
                return
        self._sensor_fresh.require(now_ns)

    def _take(self, frame: Frame, now_ns: int) -> None:
        """Use a new frame for the reference or for the grip. An unusable one is a frame lost, and counted."""
        if not self._sensor_fresh.stamped(frame.t_ns, now_ns):
            self._unusable("", now_ns)
            return
        if self._task.stage is Stage.REFERENCE:
            self._sensor_fresh.good(now_ns)
            if self._reference.add(frame):
                self.perception.start(self._reference.frames)
                self._task.reference_taken(self._clock.now())
            return
        if self._is_repeated(frame, now_ns):
            return
        try:
            self.on_frame(frame, now_ns)
        except DataError as error:
            self._unusable(str(error), now_ns)

    def _is_repeated(self, frame: Frame, now_ns: int) -> bool:
        """Pass over an image that came before; stop where nothing but it comes while an object depends on it."""
        depends = self._task.corrects_grip and self._rig.gripper is not None
        if not self._repeated.seen(frame.image) or not depends:
            self._image_fresh.good(now_ns)
            return False
        self._sensor_fresh.good(now_ns)
        self._image_fresh.require(now_ns)
        return True

    def _unusable(self, reason: str, now_ns: int) -> None:
        self.unusable_frames += 1
        if reason:
            self._sensor_fresh.bad(reason)
        self._sensor_fresh.require(now_ns)

    def _do_job(self, now_ns: int) -> None:
        """Advance the job, stream the arm's velocity, sample the truth."""
        if self._watchdog is not None:
            self._watchdog.feed()
            self._watchdog.check()
        if self._task.stage is Stage.GRASP and self._grasp.wants_sending(self._gripper_state, now_ns):
            sent = self._send_aperture(self._task.options.grip_aperture_m, allow_opening=True)
            if sent is not None:
                self._grasp.sent(sent, now_ns)
        grasped = self._rig.gripper is None or self._grasp.arrived(self._gripper_state, now_ns)
        stage = self._task.advance(now_ns, grasped)
        truth = self.truth.sample(now_ns)
        if stage is Stage.DONE or (truth is not None and truth.dropped):
            self.scheduler.stop()
            return
        arm, task = self._rig.arm, self._task.options
        if arm is not None and self._task.corrects_grip:
            twist = Twist(linear_m_s=(0.0, 0.0, self._task.lift_speed_m_s))
            command = ArmCommand(twist, task.lift_acceleration_m_s2, self._clock.now() + self._lifetime_ns)
            arm.command(self._guard.arm(command))


def _require_rate(rate_hz: float, stale_after_s: float) -> None:
    """Raise ConfigError where a healthy sensor would count as stale between two frames."""
    if 2 / rate_hz > stale_after_s:
        issue = ConfigIssue(
            "safety.stale_after_s",
            f"{stale_after_s:g} s is less than two frames of a sensor at {rate_hz:g} Hz",
            f"at least {2 / rate_hz:.3g}",
        )
        raise ConfigError("the rig", [issue])


def _period(rate_hz: float) -> int:
    return max(1, round(NS_PER_S / rate_hz))
