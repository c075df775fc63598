"""Labelled videos, one row each: inputs of the clip model, and nuisance controls."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.errors import DataError
from lsds_research.clips.features import CLIP_FRAMES, clip_features, mean_of, placements, quantiles
from lsds_research.clips.signals import CLIP_SIGNALS
from lsds_research.incipient.index import physical
from lsds_research.incipient.look import LOOKS
from lsds_research.recording_engine import WHOLE_PAD_VISIBLE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.datasets import Dataset

    Floats = NDArray[np.float64]

_WINDOW_SEED = 0x3D
"""First part of the seed that places a random clip; chosen."""
NUISANCES = ("markers", "brightness", "kept")
_PLACES = 16
"""Number of clips along a recording over which a quantile is averaged; chosen."""

MOVED_M = 6.25e-6
"""Motion of a tenth of a pixel; the codec's key frames shift all markers by 0.06 to 0.08 px."""

MOVING_SHARE = 0.75
"""Quantile over a recording's moving frames to which speeds and probabilities are pooled; chosen."""
_LEAST_QUANTILE_FRAMES = 3
"""Minimum number of moving frames for a quantile over them; chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Videos:
    """Videos whose label is known, a row each: `data` their frames, `starts` the first row of each and the end.

    `slip` (n,) 0 or 1; `clip` (n, F) as `lsds_research.clips.features.FEATURES`; `nuisance` (n, 3); `v_net` (n,)
    largest two-frame maximum of v_net in a clip (m/s of the nominal clock); `speed` (n,) quantile of the mean speed
    over the frames that moved; `frames` (n,). Further controls: `first` and `last` (n, 16) as `LOOKS`, `file` (n, 3)
    frames, bytes and number of the experiment; `window` (n, F) of one clip at a random place; `whole_pad` (n,) which of
    two setups.
    """

    data: Dataset
    starts: NDArray[np.intp]
    name: NDArray[Any]
    recording: NDArray[Any]
    object: NDArray[Any]
    slip: NDArray[np.intp]
    clip: Floats
    nuisance: Floats
    v_net: Floats
    speed: Floats
    frames: Floats
    first: Floats
    last: Floats
    file: Floats
    window: Floats
    whole_pad: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.slip)


def videos_of(data: Dataset) -> Videos:
    """Return the videos of a dataset whose label is known. Raises DataError without one."""
    data = data.where(np.asarray(data["slip"] >= 0))
    if not len(data):
        raise DataError(
            "all labels of the recordings are in doubt; add recordings with slip 0 or 1 and no label_conflict"
        )
    starts = data.starts
    spans = [slice(a, b) for a, b in pairwise(starts.tolist())]
    firsts = starts[:-1]
    names = data["recording"][firsts]
    signals = data.signals(CLIP_SIGNALS)
    nuisances = data.signals(NUISANCES).astype(np.float64)
    v_net = np.asarray(data["v_net"], np.float64)
    speed, moved = np.asarray(data["mean_speed"], np.float64), moving(data)
    clips = [clip_features(signals[span]) for span in spans]
    looks = data.signals(LOOKS).astype(np.float64)
    counts = np.diff(starts).astype(np.float64)
    of_videos = data.card.get("videos", {})
    sizes = [float(of_videos.get(name, {}).get("bytes", 0)) for name in names]
    recordings = np.array([physical(name) for name in names], object)
    nuisance = np.array([_mean(nuisances[s]) for s in spans])
    return Videos(
        data,
        starts,
        names,
        recordings,
        data["object"][firsts],
        data["slip"][firsts].astype(np.intp),
        np.array(clips),
        nuisance,
        np.array([pooled(two_frame(v_net[s]), 1.0) for s in spans]),
        np.array([while_moving(speed[s], moved[s], MOVING_SHARE) for s in spans]),
        counts,
        np.nan_to_num(looks[firsts]),
        np.nan_to_num(looks[starts[1:] - 1]),
        np.column_stack([counts, sizes, [_experiment(name) for name in recordings]]),
        np.array([clip_features(_window(signals[s], number)) for number, s in enumerate(spans)]),
        nuisance[:, NUISANCES.index("markers")] >= WHOLE_PAD_VISIBLE,
    )


def _window(signals: NDArray[np.float32], seed: int) -> NDArray[np.float32]:
    """Return one clip at a random place."""
    begin = int(np.random.default_rng([_WINDOW_SEED, seed]).integers(0, max(len(signals) - CLIP_FRAMES, 0) + 1))
    return signals[begin : begin + CLIP_FRAMES]


def _experiment(recording: str) -> float:
    """Return the number at the end of a recording's name, 0 without one."""
    found = re.search(r"(\d+)$", recording)
    return float(found.group(1)) if found else 0.0


def two_frame(v_net: Floats) -> Floats:
    """Return the larger of each frame's v_net and the one before, as the detector `threshold` does."""
    larger: Floats = np.fmax(v_net, np.concatenate([v_net[:1], v_net[:-1]]))
    return larger


def pooled(values: Floats, share: float, least: float = np.nan) -> float:
    """Return a quantile over the frames of a clip, averaged over clips spread evenly along a recording, so that it does
    not grow with the recording's length; `least` without a defined frame."""
    if not len(values):
        return least
    clips = values[placements(len(values), 1, _PLACES, CLIP_FRAMES)][:, :, None]
    found = float(mean_of(quantiles(clips, [share]))[0, 0])
    return found if np.isfinite(found) else least


def moving(data: Dataset) -> NDArray[np.bool_]:
    """Return (rows,) whether the markers moved by more than `MOVED_M` on average since the frame before."""
    seen: NDArray[np.bool_] = np.nan_to_num(data["mean_speed"] * data["dt"]) > MOVED_M
    return seen


def while_moving(values: Floats, moved: NDArray[np.bool_], share: float, least: float = 0.0) -> float:
    """Return a quantile of the values of moving frames; `least` for too few.

    A recording that shakes throughout has many small motions, a slip has few large ones: over all frames, the first
    would seem faster. A quantile does not grow with the number of frames.
    """
    kept = values[moved & np.isfinite(values)]
    return float(np.quantile(kept, share)) if len(kept) >= _LEAST_QUANTILE_FRAMES else least


def _mean(values: Floats) -> Floats:
    seen = np.isfinite(values)
    total: Floats = np.where(seen, values, 0.0).sum(axis=0)
    mean: Floats = total / np.maximum(seen.sum(axis=0), 1)
    return mean
