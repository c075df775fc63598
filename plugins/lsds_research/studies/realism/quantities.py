"""The compared quantities: displacement and speed of the markers, divergence and curl of the field, lost markers.

Taken from what `lsds track` finds, the same way for a recording and for a simulated clip.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds.errors import DataError
from lsds.tactile.feature_sets import NAMES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lsds.session.track import TrackResult

    Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Quantity:
    """One quantity: its key, how a chart names it, its unit, and from where on (in that unit) it says something: below
    lies what noise and compression make."""

    key: str
    name: str
    unit: str
    floor: float


QUANTITIES = (
    Quantity("displacement_px", "dot displacement", "px", 0.02),
    Quantity("displacement_p95_px", "dot displacement, 95th percentile of a clip", "px", 0.2),
    Quantity("speed_px", "dot speed", "px/frame", 0.002),
    Quantity("peak_speed_px", "peak dot speed of a clip", "px/frame", 0.2),
    Quantity("divergence", "divergence a marker", "1", 0.002),
    Quantity("curl", "curl a marker", "1", 0.002),
    Quantity("loss", "dots lost in a frame", "fraction", 0.01),
    Quantity("clip_loss", "dots lost in a clip", "fraction", 0.002),
)
Samples = dict[str, "Floats"]
"""Values of each quantity by key, finite, in no particular order."""


def clip_samples(result: TrackResult, rate_hz: float = 25.0) -> Samples:
    """Return the samples of one tracked clip. Raises DataError where it could not be tracked.

    Speeds are between neighbouring frames only: where a frame in between was unusable, there is none. A second is
    `rate_hz` frames by the file's own times; the true interval of the public recordings is longer and not known.
    """
    if not result.displacement_m:
        raise DataError(result.error or f"{result.source}: no frame after the first could be followed")
    moved = [displacement / result.metres_per_px for displacement in result.displacement_m]
    neighbours = np.diff(result.t_s) * rate_hz < 1.5
    # Against a reference that was taken again, displacements begin anew, often of other dots.
    again = np.isin(np.rint(np.array(result.t_s[1:]) * rate_hz), result.taken_anew)
    steps = [
        now - before
        for before, now, follows in zip(moved, moved[1:], neighbours & ~again, strict=False)
        if follows and len(now) == len(before)
    ]
    features = np.array(result.features)
    lost = 1.0 - np.array(result.kept_fraction)
    travel, speed = _lengths(moved), _lengths(steps)
    return {
        "displacement_px": travel,
        "displacement_p95_px": np.percentile(travel, [95]) if len(travel) else travel,
        "speed_px": speed,
        "peak_speed_px": speed.max(keepdims=True) if len(speed) else speed,
        "divergence": _finite(features[:, NAMES.index("div_mean")]),
        "curl": _finite(features[:, NAMES.index("curl_mean")]),
        "loss": lost,
        "clip_loss": lost.mean(keepdims=True),
    }


def pooled(samples: Sequence[Samples]) -> Samples:
    """Return the values of all clips together."""
    return {q.key: np.concatenate([clip[q.key] for clip in samples]) for q in QUANTITIES}


def _lengths(vectors: Sequence[Floats]) -> Floats:
    return _finite(np.concatenate([np.hypot(each[:, 0], each[:, 1]) for each in vectors])) if vectors else np.empty(0)


def _finite(values: Floats) -> Floats:
    return np.asarray(values[np.isfinite(values)])
