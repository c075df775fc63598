"""Calibrates slip detectors and estimators on recordings of the user's gel and camera."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.calibration.noise import ImprintNoise, imprint_noise
from lsds.calibration.thresholds import LEAST_OBJECTS, Budget, exceeds, threshold, transferable
from lsds.calibration.watched import FIRST_FRAMES, WatchedPhase
from lsds.errors import DataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Mask = NDArray[np.bool_]
    Scores = tuple[Floats, Floats]

LEAST_MOVING_FRAMES = 40
"""Minimum number of moving frames without slip for a calibration."""
LEAST_STILL = 50
"""Minimum number of still frames for a calibration."""
ENOUGH_MOVING = 100
"""Minimum number of moving frames to lower a threshold; in fewer, few alarms may be chance."""
ENOUGH_STILL = 1000
"""Minimum number of still frames to lower a threshold."""
LEAST_KEPT = 0.1
"""Minimum share of the sliding frames found before that a useful threshold still finds."""


@dataclass(frozen=True, slots=True)
class DetectionRates:
    """Performance of a detector at a threshold; NaN without frames of a kind.

    `per_100_moving` and `per_100_still` are false alarms per 100 frames without slip. `found` is the share of the
    moving frames of slides that the detector calls slip. `noticed` is the number of slides with an alarm in any frame.
    """

    threshold: float
    per_100_moving: float
    per_100_still: float
    found: float
    noticed: int


@dataclass(frozen=True, slots=True)
class CalibratedDetector:
    """A detector before and after calibration.

    `left_out` are the false alarms to expect on another object, per 100 moving and per 100 still frames: those on each
    recording of changing load, at the threshold from all others. They are NaN with only one recording. `answered`
    counts the moving and the still frames without slip in which the detector did not abstain. `share` is the part of
    the budget that the threshold keeps to on the recordings themselves, so that those left out keep to all of it.
    """

    name: str
    before: DetectionRates
    after: DetectionRates
    left_out: tuple[float, float]
    answered: tuple[int, int]
    lowers: bool
    """Whether there were enough answers to lower the threshold, too."""
    share: float = 1.0

    @property
    def is_blind(self) -> bool:
        """Whether the threshold within the budget misses the slides that were found before."""
        return self.after.found < LEAST_KEPT * self.before.found


@dataclass(frozen=True, slots=True)
class SlipCalibration:
    """Threshold of each detector, and the noise of imprint and gel (None if the imprint is known in too few frames).

    `moving` and `still` are numbers of frames without slip; `slides` is the number of recordings with slip.
    """

    detectors: tuple[CalibratedDetector, ...]
    noise: ImprintNoise | None
    moving: int
    still: int
    slides: int
    budget: Budget
    loads: int = 0
    """Recordings of changing load."""

    @property
    def transfers(self) -> bool:
        """Whether enough objects were recorded to predict false alarms on another one."""
        return self.loads >= LEAST_OBJECTS

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        noise = None if self.noise is None else self.noise._asdict()
        return asdict(self) | {"noise": noise}


def calibrate_slip(phases: Sequence[WatchedPhase], budget: Budget | None = None) -> SlipCalibration:
    """Calibrate every detector that has watched the phases. Raises DataError if they show too little."""
    budget = budget or Budget()
    quiet = [each for each in phases if each.phase != "slide" and len(each) > FIRST_FRAMES]
    slides = [each for each in phases if each.phase == "slide" and len(each) > FIRST_FRAMES]
    masks = [_masks(each) for each in quiet]
    moving, still = (sum(int(pair[kind].sum()) for pair in masks) for kind in (0, 1))
    _require(moving, still)
    motions = [motion for each in quiet for motion in each.motions[FIRST_FRAMES:]]
    detectors = tuple(_calibrated(name, quiet, slides, budget) for name in quiet[0].scores)
    loads = sum(each.phase == "load" for each in quiet)
    return SlipCalibration(detectors, imprint_noise(motions), moving, still, len(slides), budget, loads)


def _require(moving: int, still: int) -> None:
    few = []
    if moving < LEAST_MOVING_FRAMES:
        few.append(f"{moving} of {LEAST_MOVING_FRAMES} frames in which the gel moves (wriggle or shake more)")
    if still < LEAST_STILL:
        few.append(f"{still} of {LEAST_STILL} frames in which it rests (hold still for longer)")
    if few:
        raise DataError(f"recordings without slip show too little: {'; '.join(few)}")


def _masks(each: WatchedPhase) -> tuple[Mask, Mask]:
    """Return the masks of the moving and of the still frames of a recording without slip."""
    # Motion in a still recording is an accidental bump and counts as neither.
    moving = each.moving & (each.phase == "load")
    return each.counts & moving, each.counts & ~each.moving


def _scores(name: str, quiet: Sequence[WatchedPhase]) -> Scores:
    parts = [(each.score(name), *_masks(each)) for each in quiet]
    return (
        np.concatenate([np.empty(0), *(score[moving] for score, moving, _ in parts)]),
        np.concatenate([np.empty(0), *(score[still] for score, _, still in parts)]),
    )


def _calibrated(
    name: str, quiet: Sequence[WatchedPhase], slides: Sequence[WatchedPhase], budget: Budget
) -> CalibratedDetector:
    before, scores = quiet[0].thresholds[name], _scores(name, quiet)
    at_rest = _scores(name, [each for each in quiet if each.phase == "still"])

    def find(moving: Floats, still: Floats, budget: Budget) -> float:
        return _threshold((moving, np.concatenate([still, at_rest[1]])), budget, before)

    loads = [_scores(name, [each]) for each in quiet if each.phase == "load"]
    after, share, left_out = transferable(loads, budget, find)
    slid = [(each, each.score(name)) for each in slides]
    return CalibratedDetector(
        name,
        _rates(before, scores, slid),
        _rates(after, scores, slid),
        left_out,
        _answered(scores),
        _enough(scores),
        share,
    )


def _answered(scores: Scores) -> tuple[int, int]:
    moving, still = (int(np.isfinite(part).sum()) for part in scores)
    return moving, still


def _enough(scores: Scores) -> bool:
    """Return whether there are enough answers for few alarms to be significant; an abstention raises no alarm."""
    moving, still = _answered(scores)
    return moving >= ENOUGH_MOVING and still >= ENOUGH_STILL


def _threshold(scores: Scores, budget: Budget, before: float) -> float:
    """Return a detector's threshold; it is not lowered if there are too few answers."""
    found = threshold(*scores, budget)
    return max(before, found) if found <= 0 or not _enough(scores) else found


def _rates(least: float, scores: Scores, slides: Sequence[tuple[WatchedPhase, Floats]]) -> DetectionRates:
    alarms = [exceeds(score, least) & each.counts for each, score in slides]
    moved = [each.moving & each.counts for each, _ in slides]
    hits = [alarm[mask] for alarm, mask in zip(alarms, moved, strict=True)]
    found = float(np.concatenate(hits).mean()) if any(map(len, hits)) else math.nan
    return DetectionRates(least, *_per_100(scores, least), found, sum(bool(alarm.any()) for alarm in alarms))


def _per_100(scores: Scores, least: float) -> tuple[float, float]:
    moving, still = (100 * _share(exceeds(part, least)) for part in scores)
    return moving, still


def _share(alarms: Mask) -> float:
    return float(alarms.mean()) if len(alarms) else math.nan
