"""A trained model: one ONNX file and its card, run by onnxruntime.

`NAME.onnx` maps windows `x` (n, length, F) float32 to `y`: for a detector (n,) the probability of slip, for an
estimator (n, 8): vx, vy, angular velocity, speed, and their standard deviations. `NAME.json` is the card: its input
signals and their units, its training data, its scores, and the file's checksum.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.errors import DataError, ModelError
from lsds.models.intervals import NORMAL_90, Factors
from lsds.models.signals import UNITS, signal_names
from lsds.support.files import write_whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.models.window import Window

FORMAT, CLIPS = "lsds model 1", "lsds clip model 1"
OUTPUTS = {"detect": 1, "estimate": 8}
"""Numbers in a row of `y`, by job."""


@dataclass(frozen=True, slots=True)
class Card:
    """The card of a model. `threshold` is the probability above which a detector reports slip; `intervals` are the
    factors that turn an estimator's standard deviations into half widths of 90 % intervals, for vx, vy, angular
    velocity and speed; `moving_intervals` are those for frames in which it estimates motion (default: the same);
    `figures_are` is "simulated", "measured" or "simulated and measured"; `real` says which real recordings a model was
    fitted on, and what it is worth on others."""

    name: str
    job: str
    signals: tuple[str, ...]
    length: int
    figures_are: str
    threshold: float = 0.5
    intervals: tuple[float, ...] = (NORMAL_90,) * 4
    moving_intervals: tuple[float, ...] = ()
    trained_on: Mapping[str, Any] | None = None
    scores: Mapping[str, Any] | None = None
    versions: Mapping[str, str] | None = None
    real: Mapping[str, Any] | None = None

    @property
    def factors(self) -> Factors:
        """The interval factors of an estimator."""
        return Factors(self.intervals, self.moving_intervals or self.intervals)

    def as_json(self, onnx: bytes) -> dict[str, Any]:
        """Return the card as JSON values, for its model's file."""
        return {
            "format": FORMAT,
            "name": self.name,
            "job": self.job,
            "signals": {name: UNITS[name] for name in self.signals},
            "length": self.length,
            "figures_are": self.figures_are,
            "threshold": self.threshold,
            "intervals": list(self.intervals),
            "moving_intervals": list(self.factors.moving),
            "trained_on": dict(self.trained_on or {}),
            "scores": dict(self.scores or {}),
            "versions": dict(self.versions or {}),
            "sha256": hashlib.sha256(onnx).hexdigest(),
        } | ({} if self.real is None else {"real": dict(self.real)})


def save(path: Path, onnx: bytes, card: Card) -> None:
    """Write `path` (.onnx) and its card next to it, each atomically.

    Raises DataError if a file cannot be written, or if the card contains NaN because the fit has diverged.
    """
    try:
        text = json.dumps(card.as_json(onnx), indent=2, allow_nan=False) + "\n"
    except ValueError as error:
        raise DataError(f"{path}: its card contains NaN ({error}), because the fit has diverged") from error
    write_whole(path, onnx)
    write_whole(path.with_suffix(".json"), text.encode())


class Artefact:
    """A loaded model and its card."""

    def __init__(self, path: Path, card: Card, session: Any) -> None:
        self.path = path
        self.card = card
        self._session = session

    def run(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return `y` for windows (n, length, F)."""
        result: NDArray[np.float32] = self._session.run(None, {"x": x})[0]
        return result

    def bind(self, window: Window) -> Bound:
        """Return a runner bound to that window, which runs the model without copies or allocations."""
        return Bound(self._session, window.frames, OUTPUTS[self.card.job])


class Bound:
    """A model bound to one window."""

    def __init__(self, session: Any, x: NDArray[np.float32], count: int) -> None:
        self._x = x
        self._y = np.zeros(count, np.float32)
        binding = session.io_binding()
        # Keep both arrays alive as long as this object, because the binding holds only their addresses.
        binding.bind_input("x", "cpu", 0, np.float32, x.shape, x.ctypes.data)
        shape = (1,) if count == 1 else (1, count)
        binding.bind_output(session.get_outputs()[0].name, "cpu", 0, np.float32, shape, self._y.ctypes.data)
        self._run: Callable[[], None] = _bound(session, binding)

    def __call__(self) -> list[float]:
        """Return the model's output for the present content of the window."""
        self._run()
        numbers: list[float] = self._y.tolist()
        return numbers


def _bound(session: Any, binding: Any) -> Callable[[], None]:
    """Return onnxruntime's inner run method, because its wrapper takes as long as a small model; else
    the wrapper."""
    import onnxruntime

    try:
        inner = partial(session._sess.run_with_iobinding, binding._iobinding, onnxruntime.RunOptions())
        inner()
    except (AttributeError, TypeError):
        return partial(session.run_with_iobinding, binding)
    return inner


def load(path: Path, job: str) -> Artefact:
    """Load a model and its card.

    Raises ModelError if either is missing, damaged, of another format or job, or for unknown signals or units, or if
    the card belongs to another model.
    """
    try:
        onnx = path.read_bytes()
    except OSError as error:
        raise ModelError(f"{path}: cannot be read: {error.strerror or error} (train one: lsds learn train)") from error
    card, fields = _card(path, job)
    if hashlib.sha256(onnx).hexdigest() != fields.get("sha256"):
        raise ModelError(
            f"{path}: does not match its card {path.stem}.json; copy both files together, or train the model again"
        )
    session = _session(path, onnx)
    _check_interface(path, card, session)
    return Artefact(path, card, session)


def _check_interface(path: Path, card: Card, session: Any) -> None:
    """Raise ModelError if the graph does not follow the contract of a learner."""
    inputs, outputs = session.get_inputs(), session.get_outputs()
    if [(i.name, i.type) for i in inputs] != [("x", "tensor(float)")]:
        raise ModelError(
            f"{path}: not a model of lsds: its inputs are {', '.join(f'{i.name} {i.type}' for i in inputs)}"
        )
    if [o.type for o in outputs] != ["tensor(float)"]:
        raise ModelError(
            f"{path}: not a model of lsds: its outputs are {', '.join(f'{o.name} {o.type}' for o in outputs)}"
        )
    expected = [card.length, len(card.signals)]
    if list(inputs[0].shape[1:]) != expected:
        raise ModelError(f"{path}: takes windows of {inputs[0].shape[1:]}, but its card states {expected}")
    try:
        # Two windows, to detect a model with a fixed batch size of one.
        found = session.run(None, {"x": np.zeros((2, *expected), np.float32)})[0]
    except Exception as error:
        raise ModelError(f"{path}: cannot be run: {_first_line(error)}") from error
    count = OUTPUTS[card.job]
    if found.shape != ((2,) if count == 1 else (2, count)):
        raise ModelError(f"{path}: gives {list(found.shape[1:]) or 'one number'} for a window, not {count} numbers")


def _card(path: Path, job: str) -> tuple[Card, dict[str, Any]]:
    card_file = path.with_suffix(".json")
    try:
        fields = json.loads(card_file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ModelError(f"{card_file}: cannot read the model's card: {error.strerror or error}") from error
    except ValueError as error:
        raise ModelError(f"{card_file}: not a model's card: {error}") from error
    if isinstance(fields, dict) and fields.get("format") == CLIPS:
        raise ModelError(
            f"{path}: a model of whole clips, for lsds study incipient-slip; it cannot run on single frames"
        )
    if not isinstance(fields, dict) or fields.get("format") != FORMAT:
        raise ModelError(f"{card_file}: not the card of an '{FORMAT}'; train the model again")
    if fields.get("job") != job:
        raise ModelError(f"{path}: is a model to {fields.get('job')}, not to {job}")
    try:
        signals = dict(fields["signals"])
        card = Card(
            str(fields["name"]),
            job,
            tuple(signals),
            int(fields["length"]),
            str(fields["figures_are"]),
            float(fields["threshold"]),
            tuple(float(v) for v in fields["intervals"]),
            tuple(float(v) for v in fields.get("moving_intervals") or ()),
            fields.get("trained_on"),
            fields.get("scores"),
            fields.get("versions"),
            fields.get("real"),
        )
        signal_names(card.signals)
        if card.length < 1:
            raise ValueError(f"length is {card.length}; it must be at least 1")
        if not 0 <= card.threshold <= 1:
            raise ValueError(f"threshold is {card.threshold:g}; it must be from 0 to 1")
        for factors in card.factors:
            if len(factors) != 4:
                raise ValueError(f"intervals have {len(factors)} factors; each needs 4")
        if not all(0 < factor < math.inf for factors in card.factors for factor in factors):
            raise ValueError("intervals must be positive factors")
    except (KeyError, TypeError, ValueError) as error:
        raise ModelError(f"{card_file}: the card is incomplete or wrong: {type(error).__name__}: {error}") from error
    except DataError as error:
        raise ModelError(f"{card_file}: {error}") from error
    for name, unit in signals.items():
        if unit != UNITS[name]:
            raise ModelError(f"{card_file}: was trained on {name} in {unit}, here it is in {UNITS[name]}")
    return card, fields


def _session(path: Path, onnx: bytes) -> Any:
    import onnxruntime

    options = onnxruntime.SessionOptions()
    # One row at a time: more threads would only wait for each other.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
    options.log_severity_level = 3
    try:
        return onnxruntime.InferenceSession(onnx, options, providers=["CPUExecutionProvider"])
    except Exception as error:
        # onnxruntime's exceptions have no common base class.
        raise ModelError(f"{path}: not a model that can be run: {_first_line(error)}") from error


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0][:200]
