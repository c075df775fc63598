"""Calibrated intervals: factors of a model's standard deviations such that 90 % of the true values lie within.

There is one set of factors for frames in which the model estimates rest and one for estimated motion: most frames are
at rest, and a single factor would be dominated by them and too narrow in slip (Mondrian conformal prediction with the
estimate as the category). Both components of a velocity get the larger of their factors: a protocol that slides along
one axis shows no error across it, which does not mean that it is zero.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

NORMAL_90 = 1.6448536269514722
"""Half width of a normal distribution's middle 90 %, in standard deviations."""
MOVES_M_S = 3e-3
"""Estimated speed above which the object slides, m/s: the threshold of slip in measured labels."""
TURNS_RAD_S = 0.05
"""Estimated angular velocity above which it turns, rad/s: the threshold of slip in measured labels."""
LEAST_PREDICTIONS = 50
"""Minimum number of predictions for a separate calibration; chosen."""
LEAST_FACTOR = 0.05
"""Lower bound of a factor; chosen."""
SPEED_COLUMN = 3
"""Column of the speed in a model's predictions."""
RATE_COLUMN = 2
"""Column of the angular velocity in a model's predictions."""
_Four = tuple[float, ...]


class Factors(NamedTuple):
    """Factors (4,) each for vx, vy, angular velocity and speed."""

    rest: _Four = (NORMAL_90,) * 4
    moving: _Four = (NORMAL_90,) * 4

    def half_widths(self, estimated: NDArray[Any]) -> NDArray[np.float64]:
        """Return (n, 4) of a model's predictions (n, 8)."""
        chosen = np.where(_moves(estimated), np.array(self.moving), np.array(self.rest))
        return np.asarray(chosen * estimated[:, 4:], np.float64)


def conformal(true: NDArray[Any], estimated: NDArray[Any], level: float = 0.9) -> Factors:
    """Return the factors with which a fraction `level` of the intervals hold, from predictions `estimated` (n, 8) and
    held-out truths (n, 4): quantiles of |error| over standard deviation (split conformal, a normalised score)."""
    ratio = np.abs(estimated[:, :4] - true) / np.maximum(estimated[:, 4:], 1e-9)
    moves = _moves(estimated)
    return Factors(*(_quantiles(ratio, which, level) for which in (~moves, moves)))


def _moves(estimated: NDArray[Any]) -> NDArray[np.bool_]:
    slides, turns = estimated[:, SPEED_COLUMN] > MOVES_M_S, np.abs(estimated[:, RATE_COLUMN]) > TURNS_RAD_S
    return np.stack([slides, slides, turns, slides], axis=1)


def _quantiles(ratio: NDArray[Any], which: NDArray[np.bool_], level: float) -> _Four:
    found = []
    for own, chosen in zip(ratio.T, which.T, strict=True):
        values = own[chosen] if chosen.sum() >= LEAST_PREDICTIONS else own
        rank = min(1.0, level * (1 + 1 / len(values)))
        found.append(max(float(np.quantile(values, rank)), LEAST_FACTOR))
    found[:2] = [max(found[:2])] * 2
    return tuple(found)
