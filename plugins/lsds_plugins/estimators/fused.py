"""Estimator `fused`: the motion of the imprint and a trained model on the dots, joined by their covariances.

The imprint tells motion across its edges to a fraction of a pixel and says nothing along them; the dots' tremble tells
a speed roughly, in every direction. The mean weighted by inverse covariance lets each speak where it sees. The trained
model learnt in simulation, so its standard deviations count more than it states (`doubt`). Where the imprint is not
found again, the dots speak alone.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from lsds.contracts import BuildContext, Observation, SlipEstimate
from lsds_plugins.estimators.imprint import ImprintOptions, estimate_of, measured
from lsds_plugins.estimators.learned import LearnedEstimator, LearnedOptions


class FusedOptions(ImprintOptions):
    """Options of `[estimator.fused]`."""

    model: str = Field(default="", description="model file (.onnx) for the dots; empty: the shipped field-gru")
    doubt: float = Field(
        default=3.0, ge=1, le=100, description="factor of the standard deviations that the trained model states"
    )
    least_match: float = Field(
        default=0.6,
        ge=0,
        le=1,
        description="correlation with the last frame's imprint below which the dots speak alone",
    )


class FusedEstimator:
    """An `Estimator`; only the model on the dots remembers past frames."""

    def __init__(self, options: FusedOptions, context: BuildContext) -> None:
        """Load the model. Raises ModelError."""
        self._options = options
        self._dots = LearnedEstimator(LearnedOptions(model=options.model), context, name="field-gru")

    def reset(self) -> None:
        """Clear the past frames."""
        self._dots.reset()

    def update(self, observation: Observation) -> SlipEstimate:
        """Estimate; abstain where neither imprint nor dots tell anything. Angles turn clockwise on the image."""
        dots, found = self._dots.update(observation), measured(observation, self._options)
        if found is None:
            return dots
        moved, spread = found
        if dots.abstained:
            return estimate_of(moved, spread)
        std = np.array([*dots.velocity_std_m_s, dots.angular_std_rad_s]) * self._options.doubt
        told = np.array([*dots.velocity_m_s, dots.angular_rad_s])
        if not (np.isfinite(std).all() and np.isfinite(told).all()):
            return estimate_of(moved, spread)
        weight = np.linalg.inv(spread)
        other = np.diag(1 / np.maximum(std, _LEAST_STD) ** 2)
        joined = np.asarray(np.linalg.inv(weight + other), float)
        return estimate_of(np.asarray(joined @ (weight @ moved + other @ told), float), joined)


_LEAST_STD = 1e-6
"""Of a trained model, m/s and rad/s: none is surer."""
