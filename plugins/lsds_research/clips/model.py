"""A clip model as a file: fitted once on recordings of some objects, applied to those of others.

`NAME.onnx` maps `x` (n, 1, F) float32, logarithms of the figures of whole clips, to the probability of slip `y`;
`NAME.json` is its card: the objects it was trained on, the replacement of undefined figures, and the checksum. A model
runs without any training library.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.errors import ModelError
from lsds.models.artefact import CLIPS as FORMAT
from lsds.support.files import write_whole
from lsds_research.clips.features import CLIP_FRAMES, FEATURES, logged

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ClipModel:
    """A loaded model; `objects` are those it was trained on, `middle` (F,) replaces undefined figures."""

    path: Path
    objects: tuple[str, ...]
    middle: Floats
    session: Any

    def __call__(self, x: Floats) -> Floats:
        """Return (n,) the probability of slip of clips' figures (n, F)."""
        rows = logged(x, self.middle).astype(np.float32)
        probability: Floats = self.session.run(None, {"x": rows[:, None]})[0].astype(np.float64)
        return probability


def save(path: Path, onnx: bytes, middle: Floats, objects: Sequence[str], trained_on: str) -> None:
    """Write a model (.onnx) and its card. Raises DataError if a file cannot be written."""
    card = {
        "format": FORMAT,
        "frames": CLIP_FRAMES,
        "features": _features(),
        "objects": sorted(objects),
        "trained_on": trained_on,
        "figures_are": "measured",
        "middle": [float(value) for value in middle],
        "sha256": hashlib.sha256(onnx).hexdigest(),
    }
    write_whole(path, onnx)
    write_whole(path.with_suffix(".json"), (json.dumps(card, indent=1) + "\n").encode())


def load(path: Path) -> ClipModel:
    """Load a model. Raises ModelError if it is missing, damaged, or uses figures of another version."""
    card_path = path.with_suffix(".json")
    try:
        card = json.loads(card_path.read_text(encoding="utf-8"))
        onnx = path.read_bytes()
    except (OSError, ValueError) as error:
        raise ModelError(f"{path}: no clip model with a card: {error}") from error
    if not isinstance(card, dict) or card.get("format") != FORMAT:
        raise ModelError(f"{card_path}: not the card of an '{FORMAT}'")
    if hashlib.sha256(onnx).hexdigest() != card.get("sha256"):
        raise ModelError(f"{path}: not the file that {card_path.name} was written for (damaged, or copied alone?)")
    if (card.get("features"), card.get("frames")) != (_features(), CLIP_FRAMES):
        raise ModelError(f"{path}: was trained on other figures of a clip; fit it again with --save-clip-model")
    middle = np.asarray(card.get("middle", ()), np.float64)
    if middle.shape != (len(FEATURES),):
        raise ModelError(f"{card_path}: the card is incomplete")
    return ClipModel(path, tuple(card.get("objects", ())), middle, _session(path, onnx))


def _features() -> str:
    return hashlib.sha256("\n".join(FEATURES).encode()).hexdigest()


def _session(path: Path, onnx: bytes) -> Any:
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3
    try:
        session = onnxruntime.InferenceSession(onnx, options, providers=["CPUExecutionProvider"])
    except Exception as error:
        # onnxruntime's exceptions have no common base class.
        raise ModelError(f"{path}: not a model that can be run: {str(error).splitlines()[0][:200]}") from error
    return session
