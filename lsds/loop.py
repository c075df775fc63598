"""The loop: one frame from camera to gripper, while the arm does the job.

    sensor.read -> tracker -> field -> contact -> features -> detector -> estimator -> controller -> guard -> gripper

`Loop.on_frame` is that line, in that order. Everything else here is what surrounds it: the job's stages, the arm's
velocity stream, stale sensing, observers.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds.clock import NS_PER_S, nanoseconds, perf_ns, seconds
from lsds.collector import quiet_collector
from lsds.contracts import ArmCommand, GripInput, GripperCommand, Twist
from lsds.errors import CommandExpired, DataError, SafetyStop, StaleData
from lsds.histogram import LogHistogram
from lsds.safety import Guard, Watchdog
from lsds.scheduler import Phase, Scheduler
from lsds.tactile.perception import Perception
from lsds.tactile.reference import ReferenceCollector
from lsds.task import LiftTask, Stage

if TYPE_CHECKING:
    from lsds.contracts import (
        CellTruth,
        Detection,
        Frame,
        GripperState,
        MarkerTracks,
        Observation,
        SlipEstimate,
    )
    from lsds.observers import Observers
    from lsds.rig import Rig

#: The newest frame is asked for this many times per nominal frame interval: a camera's phase is its own, and a frame
#: that waits for a poll is delay in the loop, which costs more slip than any gain.
POLLS_PER_FRAME = 8
#: Time that a camera may take for its first frame.
FIRST_FRAME_S = 3.0


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


class Loop:
    """Runs a rig through a job. The rig is connected and armed; the caller closes it."""

    def __init__(self, rig: Rig, observers: Observers[Cycle]) -> None:
        config = rig.config
        self._rig = rig
        self._observers = observers
        self._clock = rig.clock
        self._perception = Perception(rig.tracker, rig.sensor.spec, config.tactile)
        self._guard = Guard(config.safety)
        self._safety = config.safety
        self._lifetime_ns = nanoseconds(config.safety.command_lifetime_s)
        self._stale_ns = nanoseconds(config.safety.stale_after_s)
        self._first_ns = nanoseconds(FIRST_FRAME_S)
        self._controls = config.controller.enabled and rig.gripper is not None
        self._may_open = bool(getattr(rig.controller, "may_open", False))
        self._start_ns = rig.clock.now()
        self._task = LiftTask(config.task, self._start_ns)
        self._reference = ReferenceCollector(config.tactile.reference_frames)
        self._last: Frame | None = None
        self._seen_seq = -1
        self._bad = ""
        self.bad_frames = 0
        self._gripper_state: GripperState | None = None
        self._held_m = math.nan
        self._truths: deque[CellTruth] = deque(maxlen=64)
        self._watchdog: Watchdog | None = None
        self._ended = False
        self.frame_to_command = LogHistogram()
        self.truth_seen: list[CellTruth] = []
        self.perception = self._perception
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
        observation, tracks = self._perception.observe(frame)
        detection = self._rig.detector.update(observation)
        estimate = self._rig.estimator.update(observation)
        command = self._correct(observation, detection, estimate, now_ns)
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
                self._truth_at(frame.t_ns),
            )
        )

    def _correct(
        self, observation: Observation, detection: Detection, estimate: SlipEstimate, now_ns: int
    ) -> float | None:
        """Ask the controller; send what the guard lets through. Return the aperture really sent."""
        gripper, state = self._rig.gripper, self._gripper_state
        if not (self._controls and self._task.corrects_grip) or gripper is None or state is None:
            return None
        wanted = self._rig.controller.update(
            GripInput(observation.t_ns, observation.dt_s, detection, estimate, self._held_m, state.aperture_m)
        )
        if wanted is None:
            return None
        return self._send_aperture(wanted, now_ns, allow_opening=self._may_open)

    def _send_aperture(self, aperture_m: float, now_ns: int, *, allow_opening: bool) -> float | None:
        gripper, task = self._rig.gripper, self._task.options
        if gripper is None:
            return None
        command = GripperCommand(aperture_m, task.grip_speed_m_s, task.grip_force_n, now_ns + self._lifetime_ns)
        held = self._held_m if math.isfinite(self._held_m) else gripper.spec.stroke_m
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
        add("sensor", self._poll_sensor, _period(rig.sensor.spec.rate_hz * POLLS_PER_FRAME), phase=Phase.TRACK)
        add("job", self._do_job, _period(schedule.arm_rate_hz), phase=Phase.COMMAND)

    def _read_gripper(self, now_ns: int) -> None:
        gripper = self._rig.gripper
        if gripper is not None:
            self._gripper_state = gripper.read()

    def _poll_sensor(self, now_ns: int) -> None:
        try:
            frame = self._rig.sensor.read()
        except StaleData:
            self._require_fresh(now_ns)
            return
        except EOFError:
            self._ended = True
            self.scheduler.stop()
            return
        if frame.seq == self._seen_seq:
            self._require_fresh(now_ns)
            return
        self._seen_seq = frame.seq
        if self._task.stage is Stage.REFERENCE:
            self._collect_reference(frame, now_ns)
            self._last = frame
            return
        if self._is_frozen(frame):
            self.bad_frames += 1
            self._bad = f"frame {frame.seq} repeats the image of the one before: check the camera"
            self._require_fresh(now_ns)
            return
        try:
            self.on_frame(frame, now_ns)
        except DataError as error:
            # One unusable frame is a frame lost; going without for too long is stale sensing.
            self.bad_frames += 1
            self._bad = str(error)
            self._require_fresh(now_ns)
            return
        self._last = frame

    def _is_frozen(self, frame: Frame) -> bool:
        """Tell whether the camera repeats itself while an object depends on it: no image comes twice to the bit."""
        if self._last is None or self._rig.gripper is None or not self._task.corrects_grip:
            return False
        now, last = frame.image, self._last.image
        # A few rows tell nearly always, at a hundredth of the cost.
        return np.array_equal(now[::48], last[::48]) and np.array_equal(now, last)

    def _collect_reference(self, frame: Frame, now_ns: int) -> None:
        if self._reference.add(frame):
            self._perception.start(self._reference.frames)
            self._task.reference_taken(now_ns)
            self._send_aperture(self._task.options.grip_aperture_m, now_ns, allow_opening=True)

    def _require_fresh(self, now_ns: int) -> None:
        newest = self._start_ns + self._first_ns if self._last is None else self._last.t_ns
        if now_ns - newest > self._stale_ns:
            raise SafetyStop(
                f"sensor: no new usable frame for {seconds(now_ns - newest):.2f} s, allowed are "
                f"{self._safety.stale_after_s} s; the arm was stopped and the grip kept "
                f"({self._bad or 'check the sensor and its cable'})"
            )

    def _do_job(self, now_ns: int) -> None:
        """Advance the job, stream the arm's velocity, sample the truth."""
        if self._watchdog is not None:
            self._watchdog.feed()
            self._watchdog.check()
        moving = self._gripper_state is not None and self._gripper_state.moving
        stage = self._task.advance(now_ns, moving)
        self._sample_truth(now_ns)
        if stage is Stage.DONE:
            self.scheduler.stop()
            return
        arm, task = self._rig.arm, self._task.options
        if arm is not None and stage in (Stage.LIFT, Stage.HOLD):
            twist = Twist(linear_m_s=(0.0, 0.0, self._task.lift_speed_m_s))
            command = ArmCommand(twist, task.lift_acceleration_m_s2, now_ns + self._lifetime_ns)
            arm.command(self._guard.arm(command))

    def _sample_truth(self, now_ns: int) -> None:
        cell = self._rig.cell
        if cell is None:
            return
        cell.advance(now_ns)
        truth = cell.truth()
        self._truths.append(truth)
        self.truth_seen.append(truth)
        if truth.dropped:
            self.scheduler.stop()

    def _truth_at(self, t_ns: int) -> CellTruth | None:
        """The sampled truth nearest to an exposure, which lies a few samples back."""
        nearest: CellTruth | None = None
        for truth in reversed(self._truths):
            if nearest is not None and abs(truth.t_ns - t_ns) > abs(nearest.t_ns - t_ns):
                break
            nearest = truth
        return nearest


def _period(rate_hz: float) -> int:
    return max(1, round(NS_PER_S / rate_hz))
