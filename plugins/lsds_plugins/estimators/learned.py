"""Learned estimators: a trained model, run by onnxruntime on a window of the last frames' signals."""

from __future__ import annotations

import math
from functools import partial

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import ABSTAINED, BuildContext, Observation, SlipEstimate
from lsds.models.intervals import MOVES_M_S, NORMAL_90, TURNS_RAD_S
from lsds.models.running import RunningModel
from lsds_plugins.models import model_path


class LearnedOptions(BaseModel):
    """Options of `[estimator.NAME]` for every learned estimator."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    model: str = Field(default="", description="model file (.onnx) with its card next to it; empty: the shipped model")
    abstain_above_std_m_s: float | None = Field(
        default=None,
        gt=0,
        le=10,
        description="maximum standard deviation of the speed; above it the estimator abstains",
    )


class LearnedEstimator:
    """An `Estimator` with standard deviations calibrated so that its 90 % intervals hold.

    The card's conformal factors (`lsds.models.intervals`) scale the model's own standard deviations.
    """

    def __init__(self, options: LearnedOptions, context: BuildContext, name: str) -> None:
        """Load the model. Raises ModelError."""
        self._model = RunningModel(model_path(name, options.model), "estimate")
        self.card = self._model.card
        self._rest, self._moving = (tuple(factor / NORMAL_90 for factor in own) for own in self.card.factors)
        self._most = math.inf if options.abstain_above_std_m_s is None else options.abstain_above_std_m_s

    def reset(self) -> None:
        """Clear the past frames."""
        self._model.reset()

    def update(self, observation: Observation) -> SlipEstimate:
        """Estimate the slip velocity; abstain if a signal is undefined, or if the standard deviation is above the
        option."""
        numbers = self._model.update(observation)
        if numbers is None or not math.isfinite(sum(numbers)):
            return ABSTAINED
        x, y, turn, speed, x_std, y_std, turn_std, speed_std = numbers
        by_x, by_y, _, by_speed = self._moving if speed > MOVES_M_S else self._rest
        by_turn = (self._moving if abs(turn) > TURNS_RAD_S else self._rest)[2]
        speed_std *= by_speed
        return SlipEstimate(
            (x, y), (x_std * by_x, y_std * by_y), turn, turn_std * by_turn, speed, speed_std, speed_std > self._most
        )


lstm = partial(LearnedEstimator, name="lstm")
mlp = partial(LearnedEstimator, name="mlp")
linear_window = partial(LearnedEstimator, name="linear-window")
field_gru = partial(LearnedEstimator, name="field-gru")
imprint_gru = partial(LearnedEstimator, name="imprint-gru")
onnx = partial(LearnedEstimator, name="onnx")
