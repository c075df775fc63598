"""Estimator `fused`: the motion of the imprint and a trained model, fused by their covariances.

The imprint measures motion across its edges to a fraction of a pixel, and none along them. The dots' tremble gives a
rough speed in every direction. The mean weighted by inverse covariance uses each where it is accurate. The model was
trained in simulation, so the standard deviations that it states are multiplied by `doubt`.

If the imprint is not found again, only the trained model is used. If the imprint rests while the model is sure of a
slide, only the model gives the translation: the imprint is then the outline of the contact, which stays in place while
a smooth object slides through it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from lsds.contracts import BuildContext, Observation, SlipEstimate
from lsds.models.intervals import MOVES_M_S
from lsds_plugins.estimators.imprint import ImprintOptions, estimate_of, measured
from lsds_plugins.estimators.learned import LearnedEstimator, LearnedOptions

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


class FusedOptions(ImprintOptions):
    """Options of `[estimator.fused]`."""

    model: str = Field(default="", description="trained model (.onnx); empty: the shipped imprint-gru")
    doubt: float = Field(
        default=6.0, ge=1, le=100, description="factor of the standard deviations that the trained model states"
    )
    least_match: float = Field(
        default=0.6,
        ge=0,
        le=1,
        description="correlation with the last frame's imprint below which only the trained model is used",
    )


class FusedEstimator:
    """An `Estimator`; only the trained model remembers past frames."""

    def __init__(self, options: FusedOptions, context: BuildContext) -> None:
        """Load the model. Raises ModelError."""
        self._options = options
        self._model = LearnedEstimator(LearnedOptions(model=options.model), context, name="imprint-gru")

    def reset(self) -> None:
        """Clear the past frames."""
        self._model.reset()

    def update(self, observation: Observation) -> SlipEstimate:
        """Estimate; abstain if neither imprint nor dots have information. Angles are clockwise on the image."""
        model, found = self._model.update(observation), measured(observation, self._options)
        if found is None:
            return model
        moved, spread = found
        if model.abstained:
            return estimate_of(moved, spread)
        std = np.maximum([*model.velocity_std_m_s, model.angular_std_rad_s], LEAST_MODEL_STD)
        modelled = np.array([*model.velocity_m_s, model.angular_rad_s])
        if not (np.isfinite(std).all() and np.isfinite(modelled).all()):
            return estimate_of(moved, spread)
        if (
            model.speed_m_s > MOVES_M_S
            and np.linalg.norm(modelled[:2] / std[:2]) > SURE_OF_SLIDE_STDS
            and _stays(observation)
        ):
            # An outline hides the translation of the object but turns with it.
            spread[:2, :2] += np.eye(2) * _ANY_M_S**2
        weight = np.linalg.inv(spread)
        other = np.diag(1 / (self._options.doubt * std) ** 2)
        joined = np.asarray(np.linalg.inv(weight + other), float)
        return estimate_of(np.asarray(joined @ (weight @ moved + other @ modelled), float), joined)


def _stays(observation: Observation) -> bool:
    """Return whether the imprint matches the last frame's as well at its old place as at its new one."""
    motion = None if observation.imprint is None else observation.imprint()
    return motion is not None and motion.match - motion.stuck_match < REGAINED


SURE_OF_SLIDE_STDS = 1.5
"""Speed, in standard deviations, above which a trained model is sure of a slide."""
REGAINED = 0.1
"""An imprint that moves, unless slowly, matches better at its new place by more than this correlation."""
_ANY_M_S = 1.0
"""Standard deviation of an unknown velocity, m/s."""
LEAST_MODEL_STD = (5e-4, 5e-4, 0.01)
"""Least standard deviation of a trained model, m/s and rad/s. At rest it states almost none, which would hide a creep
that the imprint shows."""
