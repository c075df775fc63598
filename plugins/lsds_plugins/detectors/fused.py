"""Detector `fused`: trained trees and the untrained detector `imprint`, either of which may show a slip.

An object that chatters drags the dots and leaves no travelling imprint; one that turns or slides with its relief moves
the imprint, and the dots may rest. So each has its own probability of slip, and a slip is seen if either sees it
(noisy-or, Pearson 1988, section 4.3.2). The trees saw few real frames, so they are not believed beyond certain odds,
and an imprint that rests, or that cannot be seen, counts against them. The parameters are fitted on real frames with
each object left out of the trees in turn; they are in the model's card (`real.fusion`).
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
    """Probability of slip: 1 - (1 - p_trees) (1 - p_imprint).

    The log-odds of p_trees are `trees[0] + trees[1] * (log-odds of the trees + min(ln s, 0))` with the score s of
    `imprint`, which is below 1 at rest; those of p_imprint are `imprint[0] + imprint[1] * ln s`. The trees' probability
    is kept within `trees_limit` of 0 and 1, the score within `imprint_limits`. Slip is reported above the probability
    `threshold`.
    """

    trees: tuple[float, float]
    imprint: tuple[float, float]
    trees_limit: float
    imprint_limits: tuple[float, float]
    threshold: float

    @classmethod
    def of_card(cls, values: Mapping[str, Any]) -> Self:
        """Return the fusion that a model card holds. Raises ModelError."""
        try:
            trees, imprint, limits = (_pair(values[name]) for name in ("trees", "imprint", "imprint_limits"))
            trees_limit, threshold = (float(values[name]) for name in ("trees_limit", "threshold"))
        except (KeyError, TypeError, ValueError) as error:
            raise ModelError(f"real.fusion of the card of 'fused' is incomplete: {error!r} (train it again)") from error
        usable = trees[1] > 0 and imprint[1] > 0 and 0 < trees_limit < 0.5 and 0 < limits[0] < 1 < limits[1]
        if not (usable and 0 < threshold < 1):
            raise ModelError(
                f"real.fusion of the card of 'fused' has slopes or limits that exclude all: {dict(values)}"
            )
        return cls(trees, imprint, trees_limit, limits, threshold)

    def evidence(self, probability: float, imprint_score: float) -> tuple[float, float]:
        """Return the two arguments of the log-odds; NaN for a missing score of the imprint counts as its least."""
        kept = min(max(probability, self.trees_limit), 1.0 - self.trees_limit)
        low, high = self.imprint_limits
        score = math.log(min(max(imprint_score, low), high) if math.isfinite(imprint_score) else low)
        return math.log(kept / (1.0 - kept)) + min(score, 0.0), score

    def probability(self, probability: float, imprint_score: float) -> float:
        """Return the probability of slip among frames as those that the parameters were fitted on."""
        trees, imprint = self.evidence(probability, imprint_score)
        neither = 1.0 + math.exp(self.trees[0] + self.trees[1] * trees)
        neither *= 1.0 + math.exp(self.imprint[0] + self.imprint[1] * imprint)
        return 1.0 - 1.0 / neither


def _pair(values: Any) -> tuple[float, float]:
    first, second = values
    return float(first), float(second)


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
