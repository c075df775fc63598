"""Contract of a learner: fits a model on windows of signals and exports it for the running cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol, runtime_checkable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Job = Literal["detect", "estimate"]


@dataclass(frozen=True, slots=True, eq=False)
class Examples:
    """Training examples: windows `x` (n, length, F) float32, and `y`, for a detector (n,) 0 or 1, for an
    estimator (n, 3): vx, vy (m/s) and angular velocity (rad/s) of the object against the gel, float32.

    `group` (n,) are ids of objects or recordings that must not be split between fitting and calibration; `weight` (n,)
    how much each example counts, None where all count alike. A learner may ignore weights."""

    x: NDArray[np.float32]
    y: NDArray[np.float32]
    group: NDArray[np.intp]
    weight: NDArray[np.float32] | None = None


@runtime_checkable
class Fitted(Protocol):
    """A fitted model."""

    def predict(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return predictions of the training library for windows (n, length, F): for a detector (n,) the probability of
        slip; for an estimator (n, 8): vx, vy, angular velocity, speed, their standard deviations in the same order."""
        ...

    def export(self) -> bytes:
        """Return an ONNX model: input `x` float32 (n, length, F), n free; output `y` float32, as `predict` returns."""
        ...


@runtime_checkable
class Learner(Protocol):
    """The interface of a backend of kind `learner`. Constructing imports nothing heavy.

    `job` is "detect" or "estimate", `signals` the set (or names) of its input signals, `length` the window length in
    frames.
    """

    job: Job
    signals: tuple[str, ...]
    length: int

    def fit(self, examples: Examples, seed: int) -> Fitted:
        """Fit. The same examples and seed give the same model."""
        ...
