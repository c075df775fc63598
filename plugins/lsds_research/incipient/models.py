"""Predictions of models that were trained on other data."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from lsds_plugins import models

from lsds.models import artefact
from lsds.models.signals import UNITS
from lsds_research.clips import model as clips_model
from lsds_research.datasets import Dataset
from lsds_research.incipient.table import MOVING_SHARE, moving, while_moving
from lsds_research.windows import windows

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.models.artefact import Artefact
    from lsds_research.incipient.table import Videos

    Floats = NDArray[np.float64]

POOLINGS: dict[str, tuple[float, bool]] = {
    "75 % of moving frames": (MOVING_SHARE, True),
    "median of moving frames": (0.5, True),
    "90 % of all frames": (0.9, False),
}
"""Poolings of frames' probabilities to a recording's score: a quantile, and whether it is over moving frames only.

The first is the result, and the only one shown for a shipped model; the others are comparisons.
"""

CLIP_MODEL = "clips"
_ROWS_AT_ONCE = 8192
"""Number of windows that a model scores in one call; chosen."""


def applied(named: str, slower: float, videos: Videos, notes: list[str]) -> list[tuple[str, Floats, float]]:
    """Return name, probabilities (n,) and threshold of each requested simulation-trained detector: a file's path,
    `shipped` or `none`. `slower` is how many times the true frame interval is the nominal one: rates are divided by it.
    Raises ModelError for a file that is no detector."""
    if named == "none":
        return []
    shipped = named == "shipped"
    paths = _shipped() if shipped else [Path(named)]
    if not paths:
        notes.append("no simulation-trained detector is shipped here; name one with --model FILE.onnx")
    found = []
    for path in paths:
        model = artefact.load(path, "detect")
        score = frame_scores(model, videos, slower)
        for name, (share, only_moving) in list(POOLINGS.items())[: 1 if shipped else None]:
            words = f"{model.card.name}, trained on {model.card.figures_are} data, as it is: {name}"
            found.append((words, video_scores(videos, score, share, only_moving), model.card.threshold))
    return found


def _shipped() -> list[Path]:
    return [path for path in sorted(Path(models.__file__).parent.glob("*.onnx")) if _detects(path)]


def _detects(path: Path) -> bool:
    try:
        return bool(json.loads(path.with_suffix(".json").read_text(encoding="utf-8")).get("job") == "detect")
    except (OSError, ValueError, AttributeError):
        return False


def clip_model_scores(videos: Videos) -> tuple[str, Floats, NDArray[np.bool_]] | None:
    """Return name, probabilities (n,) of the shipped clip model, and which videos (n,) are of objects that it was not
    trained on; None without such videos or without a shipped model."""
    path = Path(models.__file__).parent / f"{CLIP_MODEL}.onnx"
    if not path.is_file():
        return None
    model = clips_model.load(path)
    unseen: NDArray[np.bool_] = ~np.isin(videos.object.astype(str), model.objects)
    if len(np.unique(videos.slip[unseen])) < 2:
        return None
    return f"shipped clip model, fitted on {len(model.objects)} other objects", model(videos.clip), unseen


def frame_scores(model: Artefact, videos: Videos, slower: float) -> Floats:
    """Return (rows,) the probability of slip at each frame, NaN for unusable windows."""
    data = videos.data
    named = {name: data[name] / _rate(name, slower) for name in model.card.signals}
    x, rows = windows(Dataset({**data.columns, **named}), model.card.signals, model.card.length)
    found = np.full(len(data), np.nan)
    for at in range(0, len(x), _ROWS_AT_ONCE):
        found[rows[at : at + _ROWS_AT_ONCE]] = model.run(x[at : at + _ROWS_AT_ONCE]).reshape(-1)
    return found


def _rate(name: str, slower: float) -> float:
    if name == "dt":
        return 1 / slower
    return slower if UNITS[name].endswith("/s") else 1.0


def video_scores(videos: Videos, score: Floats, share: float, only_moving: bool) -> Floats:
    """Return (n,) each video's score: a quantile of its frames' probabilities, 0 where too few are known."""
    moved = moving(videos.data) if only_moving else np.isfinite(score)
    spans = [slice(first, end) for first, end in pairwise(videos.starts.tolist())]
    return np.array([while_moving(score[span], moved[span], share) for span in spans])
