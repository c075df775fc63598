"""Code shared by all learners: common options, checks of the examples, and the choice of held-out groups."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from lsds.errors import DataError
from lsds.models.signals import signal_names

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts.learning import Examples, Job

LEAST_WINDOWS = 50
"""Minimum number of examples."""


class LearnerOptions(BaseModel):
    """Options of every learner."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    signals: str | list[str] = Field(default="field", description="named set of signals, or their names")
    length: int = Field(default=1, ge=1, le=100, description="window length, frames")


class LearnerBase:
    """Job, signals and length of a learner. Raises DataError for an unknown signal."""

    def __init__(self, job: Job, options: LearnerOptions) -> None:
        self.job: Job = job
        self.signals = signal_names(options.signals)
        self.length = options.length

    def check(self, examples: Examples) -> None:
        """Raise DataError for examples that the learner cannot be fitted on."""
        x, y = examples.x, examples.y
        expected = (len(x), self.length, len(self.signals))
        if x.shape != expected:
            raise DataError(f"windows are {x.shape}, not {expected}: (n, frames, signals)")
        wanted = (len(x),) if self.job == "detect" else (len(x), 3)
        if y.shape != wanted or examples.group.shape != (len(x),):
            raise DataError(f"labels are {y.shape} and groups {examples.group.shape}, not {wanted} and {(len(x),)}")
        if len(x) < LEAST_WINDOWS:
            raise DataError(
                f"{len(x)} examples are too few to fit; at least {LEAST_WINDOWS} are needed, also in the part that "
                "remains when some objects are left out for the scores (collect more: without --quick, or more objects)"
            )
        for name, values in (("windows", x), ("labels", y)):
            if not np.isfinite(values).all():
                raise DataError(f"the {name} hold NaN or infinity; leave those rows out (lsds_research.windows does)")
        if self.job == "detect" and set(np.unique(y).tolist()) != {0.0, 1.0}:
            raise DataError("the labels of a detector must be 0 and 1, both of them present; check the column slip")


def targets(y: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return (n, 4): vx, vy, angular velocity and speed, of labels (n, 3)."""
    own = y.astype(np.float64)
    return np.column_stack([own, np.hypot(own[:, 0], own[:, 1])])


def hold_out(group: NDArray[np.intp], seed: int, share: float = 0.2) -> NDArray[np.bool_]:
    """Return (n,) a mask of held-out rows: whole groups drawn at random until `share` of the rows are held out; never
    all groups. With a single group, its last rows.
    """
    names, own = np.unique(group, return_inverse=True)
    if len(names) == 1:
        return np.arange(len(group)) >= round((1 - share) * len(group))
    order = np.random.default_rng([seed, 0x401D]).permutation(len(names))
    sizes = np.bincount(own)[order]
    count = int(np.searchsorted(np.cumsum(sizes), share * len(group))) + 1
    return np.isin(own, order[: min(count, len(names) - 1)])
