"""Detector `fused`: logistic regression on the logarithms of what imprint and dots did in one frame.

How far the imprint has moved against the gel, how sure that is, how well it was found again, and how much the dots
tremble, each speak for or against slip by a weight. Steps and errors span decades, hence logarithms; few labelled
slips exist on real gels, hence one frame and a linear model.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from lsds.contracts import BuildContext
from lsds.models.signals import UNITS
from lsds_research.learners.common import LearnerBase, LearnerOptions
from lsds_research.learners.logarithms import FittedLogarithms, logarithms

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts.learning import Examples

    Floats = NDArray[np.float64]

FLOORS = {"m": 6e-6, "rad": 1e-3, "1": 0.02}
"""Added before the logarithm, by unit: a tenth of a pixel, a twentieth of a degree; what is less is noise."""


class FusedOptions(LearnerOptions):
    """Options of the learner `fused`."""

    signals: str | list[str] = Field(default="imprint-and-dots", description="named set of signals, or their names")
    penalty: float = Field(default=0.5, gt=0, le=1e4, description="inverse of the L2 penalty of the weights (C)")


class Fused(LearnerBase):
    """A `Learner`."""

    def __init__(self, options: FusedOptions, context: BuildContext) -> None:
        super().__init__("detect", options)
        self._options = options

    def fit(self, examples: Examples, seed: int) -> FittedLogarithms:
        """Fit; the seed has no effect. Raises DataError for examples that cannot be fitted."""
        self.check(examples)
        from sklearn.linear_model import LogisticRegression

        floor = np.tile([FLOORS.get(UNITS[name], FLOORS["1"]) for name in self.signals], self.length)
        shaped = logarithms(examples.x, floor)
        centre, spread = shaped.mean(axis=0), shaped.std(axis=0) + 1e-9
        model = LogisticRegression(C=self._options.penalty, max_iter=5000)
        model.fit((shaped - centre) / spread, examples.y > 0.5)
        weight = model.coef_[0] / spread
        constant = float(model.intercept_[0] - centre @ weight)
        return FittedLogarithms(weight, constant, floor, self.length, len(self.signals))
