"""Following slip through a recording: every frame through the same perception as in the running cell."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext, TrackFlag
from lsds.errors import DataError
from lsds.tactile.feature_sets import FEATURES, feature_indices
from lsds.tactile.perception import Perception

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from lsds.config import RigConfig
    from lsds.contracts import Frame, MarkerReference, MarkerTracks
    from lsds.plugins import PluginHost


@dataclass(slots=True)
class TrackResult:
    """What tracking a recording gave. Lists are one entry per frame after the reference, in order.

    `displacement_m` entries are (N, 2), NaN where lost; `features` (F,) in the order of `FEATURES`. `failures` names
    each frame that could not be used and why; `error` is what ended the recording early, None for a good end.
    `frames` counts all frames read, those of the reference and unusable ones included.
    """

    source: str
    timestamps: str = "nominal"
    metres_per_px: float = math.nan
    frames: int = 0
    reference: MarkerReference | None = None
    reference_frame: Frame | None = None
    t_s: list[float] = field(default_factory=list)
    kept_fraction: list[float] = field(default_factory=list)
    flags: NDArray[np.int64] = field(default_factory=lambda: np.zeros(len(TrackFlag), np.int64))
    displacement_m: list[NDArray[np.float64]] = field(default_factory=list)
    features: list[NDArray[np.float64]] = field(default_factory=list)
    slip: list[bool | None] = field(default_factory=list)
    speed_m_s: list[float] = field(default_factory=list)
    speed_std_m_s: list[float] = field(default_factory=list)
    failures: list[tuple[int, str]] = field(default_factory=list)
    error: str | None = None
    worst: tuple[Frame, MarkerTracks] | None = None

    def summary(self) -> dict[str, Any]:
        """Return the figures of the whole recording."""
        kept = self.kept_fraction
        count = self.reference.count if self.reference else 0
        return {
            "source": self.source,
            "error": self.error,
            "frames": self.frames,
            "duration_s": self.t_s[-1] if self.t_s else 0.0,
            "timestamps": self.timestamps,
            "markers": count,
            "grid": self.reference.shape if self.reference else None,
            "pitch_px": self.reference.pitch_px if self.reference else None,
            "metres_per_px": self.metres_per_px,
            "kept_mean": float(np.mean(kept)) if kept else None,
            "kept_min": float(np.min(kept)) if kept else None,
            "flags": {flag.name.lower(): int(self.flags[flag.value]) for flag in TrackFlag},
            "largest_displacement_px": self._largest_px(),
            "slip_fraction": float(np.mean([s is True for s in self.slip])) if self.slip else None,
            "failures": [{"frame": number, "reason": reason} for number, reason in self.failures],
        }

    def as_dict(self, feature_set: str = "all") -> dict[str, Any]:
        """Return everything: the summary, the reference, and per frame kept fraction, field, features and slip.

        `feature_set` names the features wanted, see `lsds.tactile.feature_sets`.
        """
        result = self.summary()
        if self.reference is not None:
            result["reference"] = {"xy_px": np.round(self.reference.xy_px, 3), "cell": self.reference.cell}
        features = np.array(self.features).T if self.features else np.empty((len(FEATURES), 0))
        result["per_frame"] = {
            "t_s": self.t_s,
            "kept_fraction": self.kept_fraction,
            "displacement_m": [np.round(d, 9) for d in self.displacement_m],
            "slip": self.slip,
            "slip_speed_m_s": self.speed_m_s,
            "slip_speed_std_m_s": self.speed_std_m_s,
        }
        result["features"] = {
            FEATURES[i].name: {"unit": FEATURES[i].unit, "values": features[i]} for i in feature_indices(feature_set)
        }
        return result

    def _largest_px(self) -> float | None:
        norms = [float(np.nanmax(np.hypot(d[:, 0], d[:, 1]))) for d in self.displacement_m if np.isfinite(d).any()]
        return max(norms) / self.metres_per_px if norms else None


def track_recording(
    config: RigConfig, host: PluginHost, progress: Callable[[int, int], object] | None = None
) -> TrackResult:
    """Track the recording that the config's sensor names, first frame (or frames) as reference.

    `progress(done, claimed)` is called after every frame. An unusable frame is listed and passed over; a recording
    that cannot be opened, has no usable reference or ends early is `error`, with all frames before it kept.
    """
    context = BuildContext(VirtualClock(), config.seed)
    sensor: Any = host.build("sensor", config.sensor.backend, config.sensor.options(), context)
    tracker = host.build("tracker", config.tracker.backend, config.tracker.options(), context)
    detector = host.build("detector", config.detector.backend, config.detector.options(), context)
    estimator = host.build("estimator", config.estimator.backend, config.estimator.options(), context)
    options = config.sensor.options()
    result = TrackResult(str(options.get("path", config.sensor.backend)), str(options.get("timestamps", "nominal")))
    waiting: list[Frame] = []
    largest = -1.0
    try:
        perception = Perception(tracker, sensor.spec, config.tactile)
        result.metres_per_px = perception.metres_per_px
        claimed = sensor.frame_count
        for frame in sensor.frames():
            result.frames += 1
            if progress is not None:
                progress(frame.seq + 1, claimed)
            if result.reference is None:
                waiting.append(frame)
                if len(waiting) < config.tactile.reference_frames:
                    continue
                result.reference = perception.start(waiting)
                result.reference_frame = perception.reference_frame
                start_ns = frame.t_ns
                continue
            try:
                observation, tracks = perception.observe(frame)
            except DataError as error:
                result.failures.append((frame.seq, str(error)))
                continue
            if not tracks.valid.any():
                result.failures.append((frame.seq, f"frame {frame.seq}: none of the dots can be followed for certain"))
            estimate = estimator.update(observation)
            result.t_s.append((frame.t_ns - start_ns) * 1e-9)
            result.kept_fraction.append(float(tracks.valid.mean()))
            result.flags += np.bincount(tracks.flags, minlength=len(TrackFlag))
            result.displacement_m.append(observation.field.displacement_m)
            result.features.append(observation.features.values)
            result.slip.append(detector.update(observation).slip)
            result.speed_m_s.append(estimate.speed_m_s)
            result.speed_std_m_s.append(estimate.speed_std_m_s)
            moved = observation.features["mean_displacement"]
            if moved > largest:
                largest, result.worst = moved, (frame, tracks)
        if result.reference is None:
            raise DataError(
                f"{result.source}: {len(waiting)} frames, but the reference takes {config.tactile.reference_frames} "
                "(lower tactile.reference_frames)"
            )
    except DataError as error:
        message = str(error)
        result.error = message if result.source in message else f"{result.source}: {message}"
    return result
