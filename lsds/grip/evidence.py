"""How much a detector speaks for a slide: log-likelihood ratios, fitted on labelled simulated frames."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lsds.tactile.soft_finger import speed_of

if TYPE_CHECKING:
    from lsds.contracts import Detection, SlipEstimate

STILL_WEIGHTS = (-2.94, 8.54, 1.13)
"""Log-likelihood ratio of slide against stick while the squeeze is constant: intercept, slope over the score, and slope
over ln(speed in mm/s + 0.3); fitted on simulated frames (`docs/grip.md`)."""
CLOSING_WEIGHTS = (-2.99, 5.25, 0.27)
"""The same after a change of the squeeze, when the gel moves by itself and evidence of slip is weaker; same fit."""
FRAME_CORRELATION = 0.69
"""Correlation of the ratios of successive frames; same fit."""
FRAME_WEIGHT = 0.85
"""Weight of the evidence that a frame adds to the one before; same fit."""
REST_SIGNALS = 0.0, math.log(0.4)
"""Score, and ln(speed in mm/s + 0.3), of an object at rest; chosen: a speed of 0.1 mm/s."""


class SlipEvidence:
    """Turns the answers of detector and estimator on one grip into log-likelihood ratios of slide against stick.

    `closing_s`: the gel moves by itself for this time after a change of the squeeze.
    """

    def __init__(self, closing_s: float) -> None:
        self._closing_s, self._before = closing_s, REST_SIGNALS

    def take(self, detection: Detection, estimate: SlipEstimate, since_change_s: float) -> float:
        """Return the ratio of a frame, given the frame before; 0 if the detector abstains.

        `since_change_s` is the time since the squeeze has changed. The frame before counts by the present weights, or
        a change of the squeeze would turn a lasting alarm into evidence against a slide.
        """
        if detection.slip is None:
            self._before = REST_SIGNALS
            return 0.0
        weights = CLOSING_WEIGHTS if since_change_s < self._closing_s else STILL_WEIGHTS
        speed_m_s = 0.0 if estimate.abstained else speed_of(estimate)[0]
        now = probability(detection), math.log(1e3 * speed_m_s + 0.3) if math.isfinite(speed_m_s) else REST_SIGNALS[1]
        before, self._before = self._before, now
        return FRAME_WEIGHT * (_ratio(weights, now) - FRAME_CORRELATION * _ratio(weights, before))


def _ratio(weights: tuple[float, float, float], seen: tuple[float, float]) -> float:
    return weights[0] + weights[1] * seen[0] + weights[2] * seen[1]


def probability(detection: Detection) -> float:
    """Return a detector's probability of slip; of one that knows none its decision, weighted by its confidence."""
    if math.isfinite(detection.probability):
        return detection.probability
    certain = 0.5 * detection.confidence if math.isfinite(detection.confidence) else 0.0
    return 0.5 + certain if detection.slip else 0.5 - certain
