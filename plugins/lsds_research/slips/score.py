"""Scores of slip frame by frame and interval by interval, on recordings labelled by eye."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds.calibration.watched import FIRST_FRAMES, MOVING_FRAME_PX
from lsds_research.slips.labels import Interval, State, states

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

LEAST_CONFIDENCE = 0.5
"""Minimum confidence of a scored label."""
MARGIN_FRAMES = 1
"""Number of frames next to a slip or a touch in which an alarm is not false: the uncertainty of an onset."""
EARLY = 1
"""Number of frames before an interval in which a reported slip still notices it."""
LATE = 2
"""Number of frames after the first frame of an interval in which a reported slip still notices it."""


@dataclass(frozen=True, slots=True, eq=False)
class LabelledOutputs:
    """One recording: labels, and the outputs of a detector and an estimator for each frame (n,).

    `slip` is 1, 0, or NaN if the detector abstains; `moved_px` is the motion of the markers since the last frame (90th
    percentile); `slid_px` (n, 2) and `turned_deg` (n,) are the estimated slip in the frame's interval, NaN if missing.
    """

    intervals: Sequence[Interval]
    slip: Floats
    moved_px: Floats
    slid_px: Floats
    turned_deg: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """The scored frames of one recording, each (n,) bool: those that slip, and those that stick or are free, moving
    or still."""

    slip: NDArray[np.bool_]
    moving: NDArray[np.bool_]
    still: NDArray[np.bool_]


def scored_frames(intervals: Sequence[Interval], moved_px: Floats) -> Frames:
    """Return the scored frames of a recording by their state."""
    count = len(moved_px)
    state, confidence = states(intervals, count)
    known = (confidence >= LEAST_CONFIDENCE) & (np.arange(count) >= FIRST_FRAMES)
    eventful = np.isin(state, (State.SLIP, State.TOUCH, State.UNSURE))
    near = np.convolve(eventful, np.ones(2 * MARGIN_FRAMES + 1))[MARGIN_FRAMES : MARGIN_FRAMES + count] > 0
    quiet = known & np.isin(state, (State.FREE, State.STICK)) & ~near
    moving = moved_px > MOVING_FRAME_PX
    return Frames(known & (state == State.SLIP), quiet & moving, quiet & ~moving)


@dataclass(frozen=True, slots=True)
class Counts:
    """Sums over recordings: frames and frames found, false alarms, intervals and intervals noticed.

    `slip_unanswered` and `moving_unanswered` are frames in which the detector abstains: those that slip, and those that
    stick and move, or may move without a tracked marker. A still frame without an answer is not among `still`.
    """

    slip: int = 0
    found: int = 0
    moving: int = 0
    false_moving: int = 0
    still: int = 0
    false_still: int = 0
    intervals: int = 0
    noticed: int = 0
    answered: int = 0
    frames: int = 0
    slip_unanswered: int = 0
    moving_unanswered: int = 0

    def __add__(self, other: Counts) -> Counts:
        return Counts(*(a + b for a, b in zip(_tuple(self), _tuple(other), strict=True)))

    @property
    def recall(self) -> float:
        """Of the frames that slip, the share found."""
        return self.found / self.slip if self.slip else math.nan

    @property
    def noticed_share(self) -> float:
        """Of the intervals, the share noticed in time."""
        return self.noticed / self.intervals if self.intervals else math.nan

    @property
    def per_100_moving(self) -> float:
        """False alarms per 100 frames that move and stick."""
        return 100 * self.false_moving / self.moving if self.moving else math.nan

    @property
    def per_100_still(self) -> float:
        """False alarms per 100 still frames."""
        return 100 * self.false_still / self.still if self.still else math.nan

    @property
    def unanswered_share(self) -> float:
        """Of the frames that slip, the share without an answer."""
        return self.slip_unanswered / self.slip if self.slip else math.nan

    @property
    def moving_unanswered_share(self) -> float:
        """Of the frames that move and stick, the share without an answer."""
        return self.moving_unanswered / self.moving if self.moving else math.nan


def _tuple(counts: Counts) -> tuple[int, ...]:
    return tuple(getattr(counts, name) for name in Counts.__slots__)


def counted(recording: LabelledOutputs) -> Counts:
    """Return the counts of one recording. A detector that abstains finds nothing and raises no alarm."""
    frames = scored_frames(recording.intervals, recording.moved_px)
    alarm = recording.slip == 1
    onsets = onset_errors(recording)
    scored = frames.slip | frames.moving | frames.still
    answered = np.isfinite(recording.slip)
    # A frame without a tracked marker may have moved.
    unknown = frames.still & ~answered & (recording.moved_px == 0)
    moving = frames.moving | unknown
    still = frames.still & answered
    return Counts(
        int(frames.slip.sum()),
        int((frames.slip & alarm).sum()),
        int(moving.sum()),
        int((moving & alarm).sum()),
        int(still.sum()),
        int((still & alarm).sum()),
        len(onsets),
        int(np.isfinite(onsets).sum()),
        int((scored & answered).sum()),
        int((frames.slip | moving | still).sum()),
        int((frames.slip & ~answered).sum()),
        int((moving & ~answered).sum()),
    )


def scored_intervals(intervals: Sequence[Interval]) -> list[Interval]:
    """Return the intervals of slip that are scored."""
    return [
        own
        for own in intervals
        if own.state == State.SLIP and own.confidence >= LEAST_CONFIDENCE and own.first >= FIRST_FRAMES
    ]


def onset_errors(recording: LabelledOutputs) -> Floats:
    """Return for each scored interval the delay of the first alarm in frames; NaN without an alarm in time."""
    errors = []
    for own in scored_intervals(recording.intervals):
        begin = max(0, own.first - EARLY)
        alarms = np.flatnonzero(recording.slip[begin : min(own.first + LATE, own.last) + 1] == 1)
        errors.append(float(begin + alarms[0] - own.first) if len(alarms) else math.nan)
    return np.array(errors, float)


@dataclass(frozen=True, slots=True)
class Travel:
    """One interval of slip: labelled and estimated travel (px) and turn (degrees), NaN if unknown."""

    labelled_px: float
    off_px: float
    labelled_deg: float
    off_deg: float


def travels(recording: LabelledOutputs) -> list[Travel]:
    """Return the errors of travel and turn over each scored interval of slip."""
    found = []
    for own in scored_intervals(recording.intervals):
        rows = slice(own.first, own.last + 1)
        steps = recording.slid_px[rows]
        slid = np.nansum(steps, axis=0) if np.isfinite(steps).any() else np.full(2, np.nan)
        turned = recording.turned_deg[rows]
        turn = float(np.nansum(turned)) if np.isfinite(turned).any() else math.nan
        label = np.array([own.tx_px, own.ty_px])
        known = np.isfinite(label)
        off = float(np.hypot(*(slid - label)[known], *([0.0] * (2 - known.sum())))) if known.any() else math.nan
        length = float(np.hypot(*np.where(known, label, 0.0))) if known.any() else math.nan
        found.append(Travel(length, off, own.turn_deg, turn - own.turn_deg))
    return found
