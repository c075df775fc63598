"""The line of one finger: from its sensor's frame to what slip that shows.

    sensor -> gate -> reference, or: tracker -> field -> contact -> features -> detector -> estimator

`FingerLine.take` is that line, in that order. Its state (reference, tracker, windows) is one finger's own. The imprint
is a separate step: computed when a detector or estimator asks, timed and named by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.clock import nanoseconds, perf_ns
from lsds.contracts import FingerCycle
from lsds.errors import DataError, LsdsError, PluginError, StaleData, raised_by
from lsds.runtime.frame_budget import FrameBudget, may_move
from lsds.runtime.histogram import LogHistogram
from lsds.safety.validation import validated_detection, validated_estimate
from lsds.tactile.gate import FrameGate, check_image
from lsds.tactile.perception import Perception
from lsds.tactile.reference import ReferenceCollector, brightness

if TYPE_CHECKING:
    from lsds.contracts import DeformationField, Frame, MarkerTracks
    from lsds.runtime.rig import Finger, Rig
    from lsds.safety.device_calls import Call, Calls
    from lsds.tactile.imprint.motion import ImprintMotion
    from lsds.tactile.perception import Extent

#: Minimum share of a recording's markers that the tracker follows unless the gel has leapt; chosen.
LEAST_FOLLOWED = 0.5
#: Number of consecutive frames with fewer markers beyond which the gel has leapt; chosen.
LEAP_FRAMES = 12
#: Time within which a camera that opens dim settles, s; chosen.
SETTLING_S = 1.0
#: Brightness of a frame, relative to the reference, above which the camera had not settled when the reference was
#: taken; chosen above 1 / 0.7, because many public recordings open with 0.7 of their light, which does no harm.
BRIGHTER = 1.6


class FingerLine:
    """One finger at work. `newest` is the last frame with what was made of it, None before the first.

    `renewed` are the frames that a recording's reference was taken from again, because the gel had leapt (its first
    frames show another state, or it moved by more than a pitch at once) or the camera had not settled. A running cell
    stops instead, and waits for the camera. `skipped_frames` counts those of which the budget left something out.
    """

    def __init__(self, finger: Finger, rig: Rig, start_ns: int, *, live: bool = True) -> None:
        config = rig.config
        self.finger = finger
        self.gate = FrameGate(finger.label, finger.sensor.spec, config.safety, start_ns, live=live)
        self.newest: FingerCycle | None = None
        self.renewed: list[int] = []
        self.skipped_frames = 0
        limit_ms = config.tactile.budget_ms
        self._budget = FrameBudget(math.inf if limit_ms is None else limit_ms, config.tactile.budget_scale)
        self._skipped = False
        self._live, self._lost = live, 0
        self._reference = ReferenceCollector(config.tactile.reference_frames)
        self._seq = -1
        self._names = tuple(f"{kind} '{config.section(kind).backend}'" for kind in ("tracker", "detector", "estimator"))
        self._calls = rig.thread.calls
        self._reading = rig.deadline(finger.sensor, "read")
        self._updates = tuple(rig.deadlines.of(name, "update") for name in self._names)
        self.imprint = ImprintStep(self._calls, rig.deadlines.of(f"imprint of {finger.label}", "follow"))
        self.perception = Perception(
            finger.tracker,
            finger.sensor.spec,
            config.tactile,
            tracker_name=self._names[0],
            imprint_step=self.imprint,
            extent_of=None if config.tactile.budget_ms is None else self._extent_of,
        )

    @property
    def referenced(self) -> bool:
        """Whether the untouched gel was seen."""
        return self.perception.reference is not None

    def read(self, now_ns: int) -> Frame | None:
        """Read the sensor; return its frame where it is a new one.

        Raises EOFError where a recording has ended, SafetyStop where nothing usable came for too long.
        """
        try:
            frame = self._calls.make(self._reading, self.finger.sensor.read)
        except StaleData as error:
            self.gate.silent(str(error), now_ns)
            return None
        except DataError as error:
            self.gate.refuse(str(error), now_ns)
            return None
        if frame.seq == self._seq:
            self.gate.silent("", now_ns)
            return None
        self._seq = frame.seq
        return frame

    def take(self, frame: Frame, now_ns: int, *, depends: bool) -> FingerCycle | None:
        """Take a new frame along the line; return what it shows, None where it cannot be used or is the reference.

        `depends`: an object or a moving arm depends on the frame, which makes the gate stricter. Raises SafetyStop if
        nothing usable came for too long, PluginError, and DataError for an unusable reference.
        """
        if not self.gate.admit(frame, now_ns, depends=depends):
            return None
        finger, (tracker, detector, estimator), make = self.finger, self._names, self._calls.make
        tracking, detecting, estimating = self._updates
        at_work = tracker
        try:
            if not self.referenced:
                make(tracking, self._take_reference, frame, now_ns)
                return None
            try:
                self._skipped = False
                observation, tracks = make(tracking, self.perception.observe, frame)
                if not self._live and (self._was_dim(frame) or self._has_leapt(tracks)) and self._retake(frame):
                    return None
                last, skipped = self.newest, self._skipped
                if skipped and last is not None:
                    self.skipped_frames += 1
                    detection, estimate = last.detection, last.estimate
                else:
                    at_work = detector
                    detection = validated_detection(
                        detector, make(detecting, finger.detector.update, observation), frame.seq
                    )
                    at_work = estimator
                    estimate = validated_estimate(
                        estimator, make(estimating, finger.estimator.update, observation), frame.seq
                    )
            except DataError as error:
                self.gate.refuse(str(error), now_ns, frame.seq)
                return None
        except LsdsError:
            raise
        except Exception as error:
            raise raised_by(at_work, error, f"frame {frame.seq}") from error
        self.newest = FingerCycle(
            finger.name, frame, tracks, observation, detection, estimate, finger.opposite, skipped
        )
        return self.newest

    def _extent_of(self, field: DeformationField, lost_share: float) -> Extent:
        """Return how much of a frame the budget allows to compute."""
        last = None if self.newest is None else self.newest.detection
        moves = lost_share > 0 or may_move(field, last, self.perception.metres_per_px)
        # The first frame has no earlier answer that could stand.
        self._skipped = not self._budget.affords(moves=moves) and self.newest is not None
        if self._skipped:
            return "markers"
        return "in full" if moves else "at rest"

    def _has_leapt(self, tracks: MarkerTracks) -> bool:
        """Return whether most markers have been lost for so many frames that the reference is of another gel."""
        self._lost = self._lost + 1 if np.count_nonzero(tracks.valid) < LEAST_FOLLOWED * len(tracks.valid) else 0
        return self._lost > LEAP_FRAMES

    def _was_dim(self, frame: Frame) -> bool:
        """Return whether the reference was taken while the camera had not settled, now that it shows more light."""
        reference = self.perception.reference_frame
        if reference is None or frame.t_ns - reference.t_ns > nanoseconds(SETTLING_S):
            return False
        return brightness(frame) > BRIGHTER * brightness(reference)

    def reset(self) -> None:
        """Clear the past frames of detector and estimator. Raises PluginError that names one that raises."""
        parts: tuple[Any, ...] = self.finger.detector, self.finger.estimator
        for call, part in zip(self._updates[1:], parts, strict=True):
            self._calls.named(call._replace(name="reset"), part.reset, where="reset()")

    def _retake(self, frame: Frame) -> bool:
        """Take a frame as the reference, whatever touches it; return whether it shows a grid of dots."""
        self._lost = 0
        try:
            self.perception.start([frame])
        except DataError:
            return False
        self.reset()
        self.renewed.append(frame.seq)
        return True

    def _take_reference(self, frame: Frame, now_ns: int) -> None:
        try:
            check_image(frame, self.finger.sensor.spec)
        except DataError as error:
            self.gate.refuse(str(error), now_ns, frame.seq)
            return
        self.gate.good(now_ns)
        if self._reference.add(frame):
            self.perception.start(self._reference.frames)


class ImprintStep:
    """Marks, times and names the computation of one finger's imprint. `durations_ns` counts one entry a frame."""

    def __init__(self, calls: Calls, call: Call) -> None:
        self._calls, self._call = calls, call
        self.durations_ns = LogHistogram()

    def __call__(self, compute: Callable[[], ImprintMotion | None]) -> ImprintMotion | None:
        """Return the imprint's motion. Raises PluginError that names the imprint, for anything unexpected."""
        started = perf_ns()
        try:
            return self._calls.make(self._call, compute)
        except LsdsError:
            raise
        except Exception as error:
            problem = f"{self._call.who} raised {type(error).__name__}: {error}"
            raise PluginError(f"{problem} (a bug in lsds; lsds --debug shows where)") from error
        finally:
            self.durations_ns.add((perf_ns() - started,))
