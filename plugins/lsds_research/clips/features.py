"""Recordings of any length as clips of equal length, and statistics of a whole clip.

The length of a recording reveals its label but is not a sign of slip. So no statistic here may depend on it: each
clip has `CLIP_FRAMES` frames, in one piece or in pieces spread over the recording, and several placements of a clip are
averaged by their mean, never by an extreme.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from lsds_research.clips.signals import CLIP_SIGNALS, lag_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

CLIP_FRAMES = 48
"""Frames of a clip; all recordings except damaged ones have as many."""

CUTS: tuple[tuple[int, int], ...] = ((1, 16), (2, 8), (4, 8))
"""Number of pieces of a clip, and of placements averaged. One piece is as recorded; four cover a whole recording."""

QUANTILES = (0.1, 0.25, 0.5, 0.75, 0.9, 0.97)
"""Quantiles of a signal over the frames of a clip that are features; chosen."""

FEATURES: tuple[str, ...] = tuple(
    f"{name} {stat} of {pieces}"
    for pieces, _ in CUTS
    for name in CLIP_SIGNALS
    for stat in (*(f"q{round(100 * q)}" for q in QUANTILES), "std")
)
"""Names of the features that `clip_features` returns."""


def placements(count: int, pieces: int, times: int, frames: int = CLIP_FRAMES) -> NDArray[np.intp]:
    """Return (times, frames) of frame numbers: `times` clips of `frames` frames out of `count`, in `pieces`.

    The recording is divided into equal parts, one for each piece. If a part is long enough, its piece moves from the
    part's beginning to its end from clip to clip. A recording that is too short repeats frames.
    """
    width = frames // pieces
    place = (np.arange(times) + 0.5) / times if times > 1 else np.array([0.5])
    part = count / pieces
    begin = np.arange(pieces) * part + max(part - width, 0.0) * place[:, None]
    begin = np.clip(np.round(begin), 0, max(count - width, 0)).astype(np.intp)
    rows: NDArray[np.intp] = np.minimum(begin[:, :, None] + np.arange(width), count - 1)
    return rows.reshape(times, pieces * width)


def clip_features(signals: NDArray[np.float32], frames: int = CLIP_FRAMES) -> NDArray[np.float64]:
    """Return (F,) of a recording's signals (count, S), in the order of `FEATURES`: quantiles and spread over the
    frames of a clip, averaged over its placements; NaN if a signal is never defined."""
    found = [
        _pooled(signals[placements(len(signals), pieces, times, frames)], frames // pieces) for pieces, times in CUTS
    ]
    return np.concatenate(found)


def _pooled(clips: NDArray[np.float32], width: int) -> NDArray[np.float64]:
    """Return quantiles and spread of clips (times, frames, S), signal by signal, averaged over the clips."""
    own: NDArray[np.float64] = clips.astype(np.float64)
    within = np.arange(own.shape[1]) % width
    for index, name in enumerate(CLIP_SIGNALS):
        # Changes of a piece's first frames relate to frames before it, which are not part of the clip.
        own[:, within < lag_of(name), index] = np.nan
    return mean_of([*quantiles(own, QUANTILES), spread(own)]).T.ravel()


def logged(x: NDArray[np.float64], middle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return figures (n, F) as signed logarithms, linear below a thousandth (of a pitch); `middle` (F,) replaces
    undefined figures. Rounding to float32 gives a model the same input on every machine."""
    seen = np.where(np.isfinite(x), x, middle)
    return (np.sign(seen) * np.log1p(np.abs(seen) * 1e3)).astype(np.float32).astype(np.float64)


def quantiles(clips: NDArray[np.float64], wanted: Sequence[float]) -> list[NDArray[np.float64]]:
    """Return for each wanted share the quantile (times, S) over the defined frames of clips (times, frames, S); NaN
    without a defined frame."""
    ordered = np.sort(clips, axis=1)  # NaN last.
    count = np.isfinite(ordered).sum(axis=1)
    found = []
    for share in wanted:
        place = share * np.maximum(count - 1, 0)
        low = np.floor(place).astype(np.intp)
        high = np.minimum(low + 1, np.maximum(count - 1, 0))
        a = np.take_along_axis(ordered, low[:, None], axis=1)[:, 0]
        b = np.take_along_axis(ordered, high[:, None], axis=1)[:, 0]
        found.append(a + (place - low) * (b - a))
    return found


def spread(clips: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviation over the defined frames of clips (times, frames, S), (times, S)."""
    seen = np.isfinite(clips)
    count = np.maximum(seen.sum(axis=1), 1)
    mean = np.where(seen, clips, 0.0).sum(axis=1) / count
    square = np.where(seen, (clips - mean[:, None]) ** 2, 0.0).sum(axis=1) / count
    return np.where(seen.any(axis=1), np.sqrt(square), np.nan)


def mean_of(values: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the mean over the placements, (statistics, S), of statistics (times, S), NaN left out."""
    stacked = np.stack(values)
    seen = np.isfinite(stacked)
    total: NDArray[np.float64] = np.where(seen, stacked, 0.0).sum(axis=1)
    count = seen.sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
