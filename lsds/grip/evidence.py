"""How much a detector speaks for a slide: log-likelihood ratios, fitted on labelled simulated frames."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds.contracts import Detection

CLOSING_S = 0.13
"""For this time after a change of the squeeze the gel moves by itself, and evidence of slip is weaker."""
STILL, CLOSING = (-1.5, 7.9), (-1.45, 3.5)
"""Log-likelihood ratio of slide against stick at a score of zero, and its slope over the score."""
SHARED = 0.75
"""Correlation of the ratios of successive frames: what one frame gets wrong, the next does, too."""


class SlipEvidence:
    """Turns the detections of one grip into independent log-likelihood ratios of slide against stick."""

    def __init__(self) -> None:
        self._last = 0.0

    def take(self, detection: Detection, since_change_s: float) -> float:
        """Return the ratio of a frame, less what the frame before has said already; 0 if the detector abstains.

        The errors of successive frames are taken as an autoregressive process of first order, so only a frame's
        innovation is evidence. `since_change_s` is the time since the squeeze has changed.
        """
        if detection.slip is None:
            self._last *= SHARED
            return 0.0
        constant, slope = CLOSING if since_change_s < CLOSING_S else STILL
        ratio = constant + slope * probability(detection)
        last, self._last = self._last, ratio
        return (ratio - SHARED * last) / (1 + SHARED)


def probability(detection: Detection) -> float:
    """Return the score of a detector whose scores are probabilities; else its decision, weighted by its confidence."""
    if 0 <= detection.score <= 1 and 0 <= detection.threshold <= 1:
        return detection.score
    certain = 0.5 * detection.confidence if math.isfinite(detection.confidence) else 0.0
    return 0.5 + certain if detection.slip else 0.5 - certain
