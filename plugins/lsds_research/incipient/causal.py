"""The causal part of the study: scores of windows, of running decisions, and the leak of random folds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds_research.incipient.folds import Scored, fold_count, permuted, scored
from lsds_research.incipient.online import (
    PARTS,
    RULES,
    SCORED_FRAMES,
    WINDOW_FRAMES,
    after_counts,
    after_parts,
    aucs,
    online_windows,
    random_fold_auc,
    running,
    window_scores,
)
from lsds_research.learners.clip_model import clip_model
from lsds_research.metrics import Interval, auc, bootstrap

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.incipient.table import Videos

_LEAF = 5
"""Minimum number of training windows in a leaf of a tree; chosen."""


def fewer(trees: int) -> int:
    """Return the number of trees for repeated fits: a third."""
    return max(5, trees // 3)


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """The plotted values of one model: videos' recordings, labels and probabilities, (n,) each."""

    name: str
    recordings: NDArray[Any]
    slip: NDArray[np.intp]
    probability: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Causal:
    """`parts` and `counts`: by rule, the AUC of recordings after shares and numbers of frames seen."""

    rows: list[tuple[Scored, str]]
    parts: dict[str, list[float]]
    counts: dict[str, list[float]]
    leaks: dict[str, float]

    @property
    def notes(self) -> list[str]:
        """Return notes on the scores of the windows."""
        mean = self.counts["mean"]
        after = ", ".join(f"{value:.3f} after {count}" for value, count in zip(mean, SCORED_FRAMES, strict=True))
        leaks = self.leaks
        return [
            f"online, mean of all windows so far: AUC {after} frames; by share of the recording seen: "
            + ", ".join(f"{value:.3f} ({part:.0%})" for value, part in zip(self.parts["mean"], PARTS, strict=True)),
            f"windows in folds at random reach AUC {leaks['random']:.3f}, and with labels shuffled by recording, where "
            f"there is nothing to learn, {leaks['random_shuffled']:.3f}: such folds leak; by object they reach "
            f"{leaks['by_object']:.3f}, shuffled {leaks['by_object_shuffled']:.3f}",
        ]

    def details(self) -> dict[str, Any]:
        """Return the curves for the JSON."""
        return {
            "window_frames": WINDOW_FRAMES,
            "shares_seen": PARTS,
            "auc_by_share_seen": self.parts,
            "frames_seen": SCORED_FRAMES,
            "auc_by_frames_seen": self.counts,
            "window_auc": self.leaks,
        }


def causal(videos: Videos, trees: int, jobs: int, seed: int, tick: Callable[[], object]) -> Causal:
    """Score every window by a model not trained on its object, and the running decisions made from them."""
    fit = clip_model(fewer(trees), _LEAF, jobs)
    windows = online_windows(videos)
    probability = window_scores(fit, windows, seed, tick)
    courses = {name: running(windows, probability, rule) for name, rule in RULES.items()}
    rows = [
        (
            _window_row(f"online: one window of {WINDOW_FRAMES} frames", windows.recording, windows.slip, probability),
            "unseen objects",
        )
    ]
    for name, course in courses.items():
        last = after_parts(course, (1.0,))[:, 0]
        row = scored(f"online: running {name} of windows, at the end", videos.recording, videos.slip, last, seed=seed)
        rows.append((row, "unseen objects"))
    dealt = permuted(windows.slip, windows.recording, seed)
    shuffled = type(windows)(windows.x, dealt, windows.video, windows.recording, windows.object, windows.picked)
    folds = fold_count(videos.object)
    leaks = {
        "by_object": auc(windows.slip, probability),
        "by_object_shuffled": auc(dealt, window_scores(fit, shuffled, seed, tick)),
        "random": random_fold_auc(fit, windows, windows.slip, folds, seed, tick),
        "random_shuffled": random_fold_auc(fit, windows, dealt, folds, seed, tick),
    }
    return Causal(
        rows,
        {name: aucs(videos, after_parts(course)) for name, course in courses.items()},
        {name: aucs(videos, after_counts(course)) for name, course in courses.items()},
        leaks,
    )


def _window_row(
    name: str,
    recordings: NDArray[Any],
    slip: NDArray[np.intp],
    probability: NDArray[np.float64],
    threshold: float = 0.5,
) -> Scored:
    right = ((probability > threshold) == (slip > 0)).astype(np.float64)
    area: Interval = bootstrap(recordings, lambda rows: auc(slip[rows], probability[rows]), draws=100)
    return Scored(name, "window", area, bootstrap(recordings, lambda rows: float(right[rows].mean())))
