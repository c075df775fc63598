"""Models that were trained elsewhere, applied as they are."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lsds.learning import artefact, clips_model
from lsds.learning.incipient_table import pooled
from lsds.learning.windows import windows
from lsds_plugins import models

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.learning.artefact import Artefact
    from lsds.learning.incipient_table import Videos

    Floats = NDArray[np.float64]

POOLINGS: dict[str, float] = {"90 % quantile": 0.9, "median": 0.5, "maximum": 1.0}
"""How a recording's score comes out of its frames' probabilities; each over clips of equal length."""

POOLING = "90 % quantile"
"""The one that is shown of a shipped model."""

CLIP_MODEL = "clip-forest"
_BLOCK = 8192


def applied(told: str, videos: Videos, notes: list[str]) -> list[tuple[str, Floats, float]]:
    """Return name, probabilities (n,) and threshold of each simulation-trained detector that is told: a file's path,
    `shipped` or `none`. Raises ModelError for a file that is no detector."""
    if told == "none":
        return []
    shipped = told == "shipped"
    paths = _shipped() if shipped else [Path(told)]
    if not paths:
        notes.append("no simulation-trained detector is shipped here; name one with --model FILE.onnx")
    found = []
    for path in paths:
        model = artefact.load(path, "detect")
        said, rows = frame_scores(model, videos)
        for name, share in POOLINGS.items():
            if name == POOLING or not shipped:
                words = f"{model.card.name}, trained on {model.card.figures_are} data, as it is: {name} of frames"
                found.append((words, video_scores(videos, said, rows, share), model.card.threshold))
    return found


def _shipped() -> list[Path]:
    return [path for path in sorted(Path(models.__file__).parent.glob("*.onnx")) if _detects(path)]


def _detects(path: Path) -> bool:
    try:
        return bool(json.loads(path.with_suffix(".json").read_text(encoding="utf-8")).get("job") == "detect")
    except (OSError, ValueError, AttributeError):
        return False


def clip_model_said(videos: Videos) -> tuple[str, Floats] | str | None:
    """Return name and probabilities (n,) of the shipped clip model; why it cannot be shown where it has seen some of
    these objects, None where none is shipped."""
    path = Path(models.__file__).parent / f"{CLIP_MODEL}.onnx"
    if not path.is_file():
        return None
    model = clips_model.load(path)
    known = sorted(set(model.objects) & {str(name) for name in videos.object})
    if known:
        return f"the shipped clip model has seen {len(known)} of these objects and is not shown"
    return f"shipped clip model, fitted on {len(model.objects)} other objects", model(videos.clip)


def frame_scores(model: Artefact, videos: Videos) -> tuple[Floats, NDArray[np.intp]]:
    """Return the probability of slip of each usable window (m,), and the rows (m,) of their last frames."""
    x, rows = windows(videos.data, model.card.signals, model.card.length)
    said = [model.run(x[at : at + _BLOCK]).reshape(-1) for at in range(0, len(x), _BLOCK)]
    return np.concatenate(said).astype(np.float64) if said else np.zeros(0), rows


def video_scores(videos: Videos, said: Floats, rows: NDArray[np.intp], share: float) -> Floats:
    """Return (n,) each video's score: a quantile of its windows' probabilities, 0 where it has no usable window."""
    edges = np.searchsorted(rows, videos.starts)
    return np.array([pooled(said[first:end], share, 0.0) for first, end in pairwise(edges.tolist())])
