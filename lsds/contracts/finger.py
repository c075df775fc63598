"""The view of one finger: its newest frame, and all that was computed from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lsds.contracts.brief import brief

if TYPE_CHECKING:
    from lsds.contracts.values import Detection, Frame, MarkerTracks, Observation, SlipEstimate


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FingerCycle:
    """One finger's newest frame and all that was computed from it, in that sensor's plane.

    If `skipped`, the frame's budget left out contact patch, detector and estimator (`tactile.budget_ms`): the last
    contact and the last answers stand, and the imprint's motion is computed only if a later frame needs it. An
    `opposite` finger faces the object from the other side: its x axis and its sense of rotation are mirrored.
    """

    __repr__ = brief

    finger: str
    frame: Frame
    tracks: MarkerTracks
    observation: Observation
    detection: Detection
    estimate: SlipEstimate
    opposite: bool = False
    skipped: bool = False
