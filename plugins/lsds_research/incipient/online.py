"""Causal detection while a recording runs: from each window of past frames, and from all windows so far.

The label of a window is that of its recording, although most windows of a recording with slip show none; this limits
the score of single windows. Every recording gives the same number of windows to train on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds_research.clips.signals import CLIP_SIGNALS
from lsds_research.incipient.folds import Fit, by_recording, grouped
from lsds_research.metrics import auc
from lsds_research.splits import random_folds

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.incipient.table import Videos

    Floats = NDArray[np.float64]

WINDOW_FRAMES = 12
"""Number of the newest frames over which a window takes its means and maxima; chosen."""
PER_VIDEO = 24
"""Number of training windows of a video, evenly spaced."""

PARTS = tuple(round(0.1 * k, 1) for k in range(1, 11))
"""Shares of a recording after which decisions are scored."""

SCORED_FRAMES = (12, 24, 48)
"""Numbers of frames after which decisions are scored."""

RULES: dict[str, Callable[[Floats], Floats]] = {
    "mean": lambda p: np.cumsum(p) / np.arange(1, len(p) + 1),
    "90 % quantile": lambda p: np.array([np.quantile(p[: k + 1], 0.9) for k in range(len(p))]),
    "maximum": np.maximum.accumulate,
}
"""Rules that pool the windows so far to a causal decision.

A running maximum can only grow, so it depends on the length of a recording; it is included to show this.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Windows of all videos: `x` (n, F), `slip` (n,), their origin (`video` (n,) its row, `recording`, `object`), and
    `picked`, the training windows."""

    x: Floats
    slip: NDArray[np.intp]
    video: NDArray[np.intp]
    recording: NDArray[Any]
    object: NDArray[Any]
    picked: NDArray[np.intp]


def online_windows(videos: Videos) -> Windows:
    """Return every causal window: of each clip signal the present value, and mean and maximum of the last frames."""
    signals = videos.data.signals(CLIP_SIGNALS).astype(np.float64)
    spans = list(pairwise(videos.starts.tolist()))
    x = np.concatenate([_windows(signals[first:end]) for first, end in spans])
    picked = [np.unique(np.linspace(first, end - 1, PER_VIDEO).astype(np.intp)) for first, end in spans]
    own = np.repeat(np.arange(len(spans)), np.diff(videos.starts))
    return Windows(x, videos.slip[own], own, videos.recording[own], videos.object[own], np.concatenate(picked))


def _windows(signals: Floats) -> Floats:
    seen = np.nan_to_num(signals)  # The first frame has no change.
    padded = np.concatenate([np.repeat(seen[:1], WINDOW_FRAMES - 1, axis=0), seen])
    view = np.lib.stride_tricks.sliding_window_view(padded, WINDOW_FRAMES, axis=0)
    return np.concatenate([seen, view.mean(axis=-1), view.max(axis=-1)], axis=1)


def window_scores(fit: Fit, windows: Windows, seed: int, tick: Callable[[], object]) -> Floats:
    """Return the probability of each window by a model not trained on its object."""
    probability = np.full(len(windows.slip), 0.5)
    chosen = np.zeros(len(probability), bool)
    chosen[windows.picked] = True
    for train, test in grouped(windows.object, windows.slip, seed):
        rows = train[chosen[train]]
        probability[test] = fit(windows.x[rows], windows.slip[rows], seed)(windows.x[test])
        tick()
    return probability


def random_fold_auc(
    fit: Fit, windows: Windows, slip: NDArray[np.intp], count: int, seed: int, tick: Callable[[], object]
) -> float:
    """Return the AUC of windows in folds at random, which leaks: a window's neighbours are trained on.

    `slip` (n,) are the training labels, true or permuted by recording."""
    rows = windows.picked
    probability = np.full(len(rows), 0.5)
    for train, test in random_folds(slip[rows], count, seed):
        probability[test] = fit(windows.x[rows[train]], slip[rows[train]], seed)(windows.x[rows[test]])
        tick()
    return auc(slip[rows], probability)


def running(windows: Windows, probability: Floats, rule: Callable[[Floats], Floats]) -> list[Floats]:
    """Return for each video the rule's result after each of its frames."""
    ends = np.flatnonzero(np.diff(windows.video)) + 1
    return [rule(part) for part in np.split(probability, ends)]


def after_parts(course: list[Floats], parts: tuple[float, ...] = PARTS) -> Floats:
    """Return (videos, parts) the results after each share of a video."""
    return np.array([[c[max(0, round(part * len(c)) - 1)] for part in parts] for c in course])


def after_counts(course: list[Floats], counts: tuple[int, ...] = SCORED_FRAMES) -> Floats:
    """Return (videos, counts) the results after each count of frames, or at the end of a shorter video."""
    return np.array([[c[min(count, len(c)) - 1] for count in counts] for c in course])


def aucs(videos: Videos, probability: Floats) -> list[float]:
    """Return the AUC at recording level of each column of `probability` (videos, k)."""
    slip = by_recording(videos.recording, videos.slip.astype(np.float64)) > 0.5
    return [auc(slip, by_recording(videos.recording, column)) for column in probability.T]
