"""Estimator `fused`: the motion of the imprint and a trained model, joined by their covariances.

The imprint tells motion across its edges to a fraction of a pixel and says nothing along them; the dots' tremble tells
a speed roughly, in every direction. The mean weighted by inverse covariance lets each speak where it sees. The trained
model learnt in simulation, so its standard deviations count more than it states (`doubt`).

Where the imprint is not found again, the trained model speaks alone. Where it is found where it was, while the model is
sure that something slides, the model alone tells the translation: what is seen is then the outline of the contact,
which stays where it is while a smooth object slides through it.
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
        description="correlation with the last frame's imprint below which the trained model speaks alone",
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
        """Estimate; abstain where neither imprint nor dots tell anything. Angles turn clockwise on the image."""
        model, found = self._model.update(observation), measured(observation, self._options)
        if found is None:
            return model
        moved, spread = found
        if model.abstained:
            return estimate_of(moved, spread)
        std = np.maximum([*model.velocity_std_m_s, model.angular_std_rad_s], LEAST_STD)
        told = np.array([*model.velocity_m_s, model.angular_rad_s])
        if not (np.isfinite(std).all() and np.isfinite(told).all()):
            return estimate_of(moved, spread)
        if model.speed_m_s > MOVES_M_S and np.linalg.norm(told[:2] / std[:2]) > SURE and _stays(observation):
            # Of the imprint's translation nothing counts; a turn is not seen through an outline, but by it.
            spread[:2, :2] += np.eye(2) * _ANY_M_S**2
        weight = np.linalg.inv(spread)
        other = np.diag(1 / (self._options.doubt * std) ** 2)
        joined = np.asarray(np.linalg.inv(weight + other), float)
        return estimate_of(np.asarray(joined @ (weight @ moved + other @ told), float), joined)


def _stays(observation: Observation) -> bool:
    """Tell whether the imprint matches that of the last frame as well where it was as where it was followed to."""
    motion = None if observation.imprint is None else observation.imprint()
    return motion is not None and motion.match - motion.stuck_match < REGAINED


SURE = 1.5
"""A trained model is sure that something slides from so many of its standard deviations on."""
REGAINED = 0.1
"""An imprint that truly moves matches better by more than this where it was followed to, unless it moves little."""
_ANY_M_S = 1.0
"""Standard deviation of what is not known at all, m/s."""
LEAST_STD = (5e-4, 5e-4, 0.01)
"""Of a trained model, m/s and rad/s: at rest it states next to none, and would hide a creep that the imprint shows."""
