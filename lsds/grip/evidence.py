"""How much a detector speaks for a slide: log-likelihood ratios, by fits on labelled simulated frames."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from lsds.tactile.contact_load import speed_of

if TYPE_CHECKING:
    from lsds.contracts import Detection, SlipEstimate

STILL_WEIGHTS = (-2.3, 7.2, 1.1)
"""Log-likelihood ratio of slide against stick while the squeeze is constant: intercept, slope over the score, and slope
over ln(speed in mm/s + 0.3); between two fits on simulated rounds (`lsds_research.studies.grip.fit_evidence`)."""
CLOSING_WEIGHTS = (-1.7, 5.4, 0.2)
"""The same after a change of the squeeze, when the gel moves by itself and evidence of slip is weaker; same fits."""
MOST_EVIDENCE = 4.0
"""Maximum evidence of one round, log-likelihood ratio; chosen, so that no frame decides alone."""
USUAL_FRAMES = 10_000
"""Number of frames in which a detector is assumed to alarm once without a slide, before anything is known of it on this
grip; chosen, so that only the fitted weights bound the first alarm. With fewer than 2000 a slip whose load is not known
is not believed, and with 3000 one more of 57 objects of draw 1010 was lost."""
REST_SIGNALS = 0.0, math.log(0.4)
"""Score, and ln(speed in mm/s + 0.3), of an object at rest; chosen: a speed of 0.1 mm/s."""

Weights = tuple[float, float, float]


class Evidence(NamedTuple):
    """New evidence of a frame, log-likelihood ratios of slide against stick: for an object that slid in the frame
    before already (`lasting`), and for one that has begun to slide since (`begun`)."""

    lasting: float
    begun: float


class SlipEvidence:
    """Turns the answers of detector and estimator on one grip into log-likelihood ratios of slide against stick.

    Detector and estimator err together from frame to frame: the fit finds a correlation of 1. So the answers of a frame
    replace those of the frame before, and an alarm counts once, however long it lasts. Of an object that has just begun
    to slide, those of the frame before said nothing: silence counts in full, and an alarm that was there before counts
    nothing, because it was false then.

    A detector that alarms without a slide once in n frames can say at most ln n for one. How often this one does is
    estimated from its alarms on this grip, which all count as false: `USUAL_FRAMES` are those of one alarm before.

    `closing_s`: the gel moves by itself for this time after a change of the squeeze.
    """

    def __init__(self, closing_s: float, still: Weights = STILL_WEIGHTS, closing: Weights = CLOSING_WEIGHTS) -> None:
        self._closing_s, self._still, self._closing = closing_s, still, closing
        self._before, self._given, self._closes = REST_SIGNALS, 0.0, True
        self._frames, self._alarms, self._alarmed = 0, 0, False

    def take(self, detection: Detection, estimate: SlipEstimate, since_change_s: float) -> Evidence:
        """Return what a frame adds to the evidence given before, at most `MOST_EVIDENCE` either way; the rest follows
        with the next frames. 0 if the detector abstains.

        `since_change_s` is the time since the squeeze has changed. The change itself, from which on a frame says less,
        is no evidence: it would turn a lasting alarm into evidence against a slide.
        """
        if detection.slip is None:
            # Its answer before stands: an alarm that goes on after an abstention is no new one.
            return Evidence(0.0, 0.0)
        closes, closed = since_change_s < self._closing_s, self._closes
        weights = self._closing if closes else self._still
        if closes and not closed:
            self._given = _ratio(weights, self._before)
        speed_m_s = 0.0 if estimate.abstained else speed_of(estimate)[0]
        now = probability(detection), math.log(1e3 * speed_m_s + 0.3) if math.isfinite(speed_m_s) else REST_SIGNALS[1]
        self._before, self._closes = now, closes
        self._frames += 1
        self._alarms += bool(detection.slip) and not self._alarmed
        self._alarmed = bool(detection.slip)
        most = math.log((USUAL_FRAMES + self._frames) / (1 + self._alarms))
        added = min(max(min(_ratio(weights, now), most) - self._given, -MOST_EVIDENCE), MOST_EVIDENCE)
        self._given += added
        return Evidence(added, min(max(added, 0.0), max(_ratio(weights, now), -MOST_EVIDENCE)))


def _ratio(weights: Weights, seen: tuple[float, float]) -> float:
    return weights[0] + weights[1] * seen[0] + weights[2] * seen[1]


def probability(detection: Detection) -> float:
    """Return a detector's probability of slip; of one that knows none its decision, weighted by its confidence."""
    if math.isfinite(detection.probability):
        return detection.probability
    certain = 0.5 * detection.confidence if math.isfinite(detection.confidence) else 0.0
    return 0.5 + certain if detection.slip else 0.5 - certain
