"""Detector `fused`: trained trees and the untrained detector `imprint`, as two independent pieces of evidence.

The log-odds of the trees and the logarithm of the score of `imprint` are added. The trees saw few real frames, so they
are not believed beyond certain odds; `imprint` knows nothing of the markers. The model's card holds the logistic
function that turns the sum into a probability, fitted on real frames with each object left out of the trees in turn
(`real.fusion`). Without an imprint its term is the least there is, which raises the threshold of the trees.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

from lsds.contracts import BuildContext, Detection, Observation
from lsds.errors import ModelError
from lsds_plugins.detectors.imprint import ImprintDetector, ImprintDetectorOptions
from lsds_plugins.detectors.learned import LearnedDetector, LearnedOptions


@dataclass(frozen=True, slots=True)
class Fusion:
    """Log-odds of slip: `offset + slope * (log-odds of the trees + ln(score of imprint))`.

    The trees' probability is kept within `trees_limit` of 0 and 1, the score within `imprint_limits`. Slip is reported
    above the probability `threshold`.
    """

    offset: float
    slope: float
    trees_limit: float
    imprint_limits: tuple[float, float]
    threshold: float

    @classmethod
    def of_card(cls, values: Mapping[str, Any]) -> Self:
        """Return the fusion that a model card holds. Raises ModelError."""
        try:
            low, high = values["imprint_limits"]
            numbers = [float(values[name]) for name in ("offset", "slope", "trees_limit", "threshold")]
            limits = float(low), float(high)
        except (KeyError, TypeError, ValueError) as error:
            raise ModelError(f"real.fusion of the card of 'fused' is incomplete: {error!r} (train it again)") from error
        offset, slope, trees_limit, threshold = numbers
        if not (0 < trees_limit < 0.5 and 0 < limits[0] < limits[1] and 0 < threshold < 1):
            raise ModelError(f"real.fusion of the card of 'fused' has limits that exclude all: {dict(values)}")
        return cls(offset, slope, trees_limit, limits, threshold)

    def evidence(self, probability: float, imprint_score: float) -> float:
        """Return the sum of the two logarithms; NaN for a missing score of the imprint counts as its least."""
        kept = min(max(probability, self.trees_limit), 1.0 - self.trees_limit)
        low, high = self.imprint_limits
        score = min(max(imprint_score, low), high) if math.isfinite(imprint_score) else low
        return math.log(kept / (1.0 - kept)) + math.log(score)

    def probability(self, probability: float, imprint_score: float) -> float:
        """Return the probability of slip among frames as those that the function was fitted on."""
        return 1.0 / (1.0 + math.exp(-(self.offset + self.slope * self.evidence(probability, imprint_score))))


class FusedDetector:
    """A `Detector`. Its score decides; `probability` is that of the trees, which the grip's evidence is fitted to."""

    def __init__(self, options: LearnedOptions, context: BuildContext) -> None:
        """Load the model. Raises ModelError."""
        self._trees = LearnedDetector(options, context, "fused")
        self._imprint = ImprintDetector(ImprintDetectorOptions(), context)
        self.card = self._trees.card
        values = (self.card.real or {}).get("fusion")
        self._fusion = Fusion.of_card(values) if values is not None else None
        own = options.threshold
        self._threshold = own if own is not None or self._fusion is None else self._fusion.threshold
        self._abstain_below = options.abstain_below

    def reset(self) -> None:
        """Clear the past frames."""
        self._trees.reset()

    def update(self, observation: Observation) -> Detection:
        """Detect slip; abstain if a signal of the trees is undefined, or if the confidence is below the option."""
        trees = self._trees.update(observation)
        if self._fusion is None or self._threshold is None:
            return trees
        threshold = self._threshold
        if not math.isfinite(trees.probability):
            return replace(trees, threshold=threshold)
        score = self._fusion.probability(trees.probability, self._imprint.update(observation).score)
        slip = score > threshold
        confidence = (score - threshold) / (1.0 - threshold) if slip else (threshold - score) / threshold
        decided = slip if confidence >= self._abstain_below else None
        return Detection(decided, score, threshold, confidence, trees.probability)
