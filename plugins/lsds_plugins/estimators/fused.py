"""Estimator `fused`: the motion of the imprint and a trained model, fused by their covariances.

The imprint measures motion across its edges to a fraction of a pixel, and none along them. The dots' tremble gives a
rough speed in every direction. The mean weighted by inverse covariance uses each where it is accurate. The model was
trained in simulation, so the standard deviations that it states are multiplied by `doubt`.

If the imprint is not found again, only the trained model is used. If the imprint rests while the model is sure of a
slide, only the model gives the translation: the imprint is then the outline of the contact, which stays in place while
a smooth object slides through it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from pydantic import Field

from lsds.contracts import BuildContext, Observation, SlipEstimate
from lsds.models.intervals import MOVES_M_S
from lsds.tactile.imprint.uncertainty import Symmetric, inverse
from lsds_plugins.estimators.imprint import ImprintOptions, Velocity, estimate_of, measured
from lsds_plugins.estimators.learned import LearnedEstimator, LearnedOptions


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
            return model if model.abstained else _in_doubt(model)
        moved, spread = found
        if model.abstained:
            return estimate_of(moved, spread)
        doubts = _stds(model)
        modelled = (*model.velocity_m_s, model.angular_rad_s)
        # The sum is NaN or infinite if any number is.
        if not math.isfinite(sum(doubts) + sum(modelled)):
            return estimate_of(moved, spread)
        stds = [max(std, least) for std, least in zip(doubts, LEAST_MODEL_STD, strict=True)]
        if (
            model.speed_m_s > MOVES_M_S
            and math.hypot(modelled[0] / stds[0], modelled[1] / stds[1]) > SURE_OF_SLIDE_STDS
            and _stays(observation)
        ):
            # An outline hides the translation of the object but turns with it.
            xx, xy, xt, yy, yt, tt = spread
            spread = (xx + _ANY_M_S**2, xy, xt, yy + _ANY_M_S**2, yt, tt)
        return estimate_of(*_joined(moved, spread, modelled, [self._options.doubt * std for std in stds]))


def _in_doubt(model: SlipEstimate) -> SlipEstimate:
    """Return a model's estimate with standard deviations that are not below their least values."""
    x, y, turn = (max(std, least) for std, least in zip(_stds(model), LEAST_MODEL_STD, strict=True))
    speed = max(model.speed_std_m_s, min(LEAST_MODEL_STD[:2]))
    return replace(model, velocity_std_m_s=(x, y), angular_std_rad_s=turn, speed_std_m_s=speed)


def _stds(model: SlipEstimate) -> Velocity:
    return (*model.velocity_std_m_s, model.angular_std_rad_s)


def _joined(
    moved: Velocity, spread: Symmetric, modelled: Velocity, stds: Sequence[float]
) -> tuple[Velocity, Symmetric]:
    """Return the mean of two velocities weighted by their inverse covariances, and its covariance."""
    xx, xy, xt, yy, yt, tt = inverse(spread)
    own_x, own_y, own_t = (1 / std**2 for std in stds)
    x, y, turn = moved
    to_x = xx * x + xy * y + xt * turn + own_x * modelled[0]
    to_y = xy * x + yy * y + yt * turn + own_y * modelled[1]
    to_t = xt * x + yt * y + tt * turn + own_t * modelled[2]
    joined = inverse((xx + own_x, xy, xt, yy + own_y, yt, tt + own_t))
    xx, xy, xt, yy, yt, tt = joined
    velocity = (xx * to_x + xy * to_y + xt * to_t, xy * to_x + yy * to_y + yt * to_t, xt * to_x + yt * to_y + tt * to_t)
    return velocity, joined


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
