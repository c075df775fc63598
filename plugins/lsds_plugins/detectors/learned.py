"""Learned detectors: a trained model, run by onnxruntime on a window of the last frames' signals."""

from __future__ import annotations

import math
from functools import partial

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext, Detection, Observation
from lsds.models.running import RunningModel
from lsds_plugins.models import model_path


class LearnedOptions(BaseModel):
    """Options of `[detector.NAME]` for every learned detector."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    model: str = Field(default="", description="model file (.onnx) with its card next to it; empty: the shipped model")
    threshold: float | None = Field(
        default=None, gt=0, lt=1, description="probability above which slip is detected; default: that of the card"
    )
    abstain_below: float = Field(
        default=0.0, ge=0, le=1, description="minimum confidence; below it the detector abstains"
    )


class LearnedDetector:
    """A `Detector` whose score is a probability.

    Confidence is 0 at the threshold and 1 at certainty on either side.
    """

    def __init__(self, options: LearnedOptions, context: BuildContext, name: str) -> None:
        """Load the model. Raises ModelError."""
        self._model = RunningModel(model_path(name, options.model), "detect")
        self.card = self._model.card
        self._threshold = self.card.threshold if options.threshold is None else options.threshold
        self._abstain_below = options.abstain_below

    def reset(self) -> None:
        """Clear the past frames."""
        self._model.reset()

    def update(self, observation: Observation) -> Detection:
        """Detect slip; abstain if a signal is undefined, or if the confidence is below the option."""
        threshold = self._threshold
        numbers = self._model.update(observation)
        if numbers is None:
            return Detection(None, math.nan, threshold, 0.0)
        score = numbers[0]
        if score > threshold:
            slip, confidence = True, (score - threshold) / (1.0 - threshold)
        elif score <= threshold:
            slip, confidence = False, (threshold - score) / threshold if threshold > 0 else 0.0
        else:
            return Detection(None, math.nan, threshold, 0.0)
        return Detection(slip if confidence >= self._abstain_below else None, score, threshold, confidence, score)


random_forest = partial(LearnedDetector, name="random-forest")
gradient_boosting = partial(LearnedDetector, name="gradient-boosting")
logistic = partial(LearnedDetector, name="logistic")
field_mlp = partial(LearnedDetector, name="field-mlp")
monotone = partial(LearnedDetector, name="monotone")
onnx = partial(LearnedDetector, name="onnx")
