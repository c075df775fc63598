"""Track slip in a recording, with the same perception as in the running cell."""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.clock import VirtualClock
from lsds.config import BackendSection, RigConfig, load_config
from lsds.config.own import own_section
from lsds.config.toml import value_text
from lsds.contracts import TrackFlag
from lsds.errors import DataError, LsdsError, naming
from lsds.registry import PluginHost
from lsds.registry.backends import NO_DEVICE
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig
from lsds.session.parts import loaded
from lsds.session.recording import ENDING, recorder_of
from lsds.support.blas import one_blas_thread
from lsds.tactile.feature_sets import FEATURES, feature_indices
from lsds.tactile.working_image import lamps_are_turned

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from lsds.contracts import Cycle, Frame, MarkerReference, MarkerTracks
    from lsds.runtime.finger_pipeline import FingerLine


UNASKED = ("detector.backend=lsds:threshold", "estimator.backend=lsds:field")
"""Overrides of an engine whose own detector and estimator are not used: the cheapest ones."""


@dataclass(slots=True)
class TrackResult:
    """The result of tracking a recording. Lists have one entry per frame after the reference, in order.

    `displacement_m` entries are (N, 2), NaN where lost; `features` (F,) in the order of `FEATURES`. `failures` names
    each frame that could not be used and why; `renewed` are frames from which the reference was taken again, because
    most dots had been lost for half a second; `notes` are doubts about the recording as a whole; `error` is what ended
    the recording early, None if it was read to the end, and `cause` the exception behind it, if any. `frames` counts
    all frames read, those of the reference and unusable ones included. All px are those of the working image, which is
    about 320 px wide.
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
    cause: BaseException | None = None
    renewed: list[int] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    worst: tuple[Frame, MarkerTracks, MarkerReference] | None = None
    largest_m: float = -1.0

    def __post_init__(self) -> None:
        # A file name may contain bytes that are not valid text; the output must be text.
        self.source = self.source.encode(errors="backslashreplace").decode()

    def summary(self) -> dict[str, Any]:
        """Return the summary figures of the recording."""
        kept = self.kept_fraction
        return {
            "source": self.source,
            "error": self.error,
            "frames": self.frames,
            "duration_s": self.t_s[-1] if self.t_s else 0.0,
            "timestamps": self.timestamps,
            "markers": self.reference.count if self.reference else 0,
            "grid": self.reference.shape if self.reference else None,
            "pitch_px": self.reference.pitch_px if self.reference else None,
            "metres_per_px": self.metres_per_px,
            "kept_mean": float(np.mean(kept)) if kept else None,
            "kept_min": float(np.min(kept)) if kept else None,
            "flags": {flag.name.lower(): int(self.flags[flag.value]) for flag in TrackFlag},
            "largest_displacement_px": self._largest_px(),
            "slip_fraction": float(np.mean([s is True for s in self.slip])) if self.slip else None,
            "reference_renewed": self.renewed,
            "notes": self.notes,
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


@one_blas_thread()
def track(
    source: str | Path,
    config: RigConfig | str | Path | None = None,
    overrides: str | Sequence[str] = (),
    *,
    progress: Callable[[int, int], object] | None = None,
    record: str | Path | None = None,
) -> TrackResult:
    """Track a recording: a video file, a folder of images, a pattern such as "clip/*.png", or a recorded run, F.mcap.

    `config` is a configuration or its file; `overrides` change a file's keys ("tracker.backend=centroid"). Raises
    ConfigError, PluginError; an error of the recording is in the result's `error`. `record` is a new file, F.mcap, for
    frames and answers (`lsds.session.recording`); raises DataError if it cannot be written.
    """
    host = PluginHost()
    return track_recording(_of_recording(source, config, overrides, host), host, progress, record)


def watch(
    source: str | Path, config: RigConfig | str | Path | None = None, overrides: str | Sequence[str] = ()
) -> Iterator[Cycle]:
    """Yield a cycle for each usable frame of a recording, with all results; arguments as for `track`.

    Raises ConfigError, PluginError, and DataError for a recording that cannot be read.
    """
    yield from engine_of(source, config, overrides)


def engine_of(
    source: str | Path, config: RigConfig | str | Path | None = None, overrides: str | Sequence[str] = ()
) -> Engine:
    """Return the engine that watches a recording; arguments and errors as for `watch`."""
    host = PluginHost()
    chosen = _of_recording(source, config, overrides, host)
    return Engine(Rig(only_watching(chosen), host, clock=VirtualClock()))


def _of_recording(
    source: str | Path, config: RigConfig | str | Path | None, overrides: str | Sequence[str], host: PluginHost
) -> RigConfig:
    """Return the configuration with the recording as its only sensor."""
    backend = "recording" if Path(source).suffix.lower() == ENDING else "video"
    if isinstance(config, RigConfig):
        config = loaded(config, overrides)
        options = {**config.section("sensor").tables.get(backend, {}), "path": str(source)}
        return config.model_copy(update={"sensor": own_section(backend, options), "sensors": {}})
    # Only the first frame of a recording is assumed to be without contact; a config or an override can change this.
    defaults = ["tactile.reference_frames=1"] if config is None else []
    path = f"sensor.{backend}.path={value_text(str(source))}"
    chosen = f"sensor.backend={host.own('sensor', backend)}"
    given = (overrides,) if isinstance(overrides, str) else overrides
    return load_config(config, [*defaults, *given, chosen, path], host=host, without=("sensors",))


def track_recording(
    config: RigConfig,
    host: PluginHost | None = None,
    progress: Callable[[int, int], object] | None = None,
    record: str | Path | None = None,
) -> TrackResult:
    """Track the recording that the config's sensor names, its first settled frames as reference.

    `progress(done, claimed)` is called after every frame. An unusable frame is listed and skipped; if the recording
    cannot be opened, has no usable reference or ends early, `error` is set and all earlier frames are kept.
    """
    options = config.section("sensor").options()
    source = str(options.get("path", config.section("sensor").backend))
    result = TrackResult(source, str(options.get("timestamps", "nominal")))
    host = host or PluginHost()
    # Build only the recording and the algorithms, and no device of the config.
    rig = Rig(only_watching(config), host, clock=VirtualClock())
    try:
        with _explained("frame 0"):
            engine = Engine(rig)
            line = engine.lines[0]
            claimed = getattr(rig.sensor, "frame_count", 0)
            if config.tactile.mm_per_px is None:
                result.notes += getattr(rig.sensor, "notes", ())
        recorder = recorder_of(rig, record)
        if recorder is not None:
            engine.events.add("recording", recorder.observe, recorder.close)
        if progress is not None:
            reported = progress
            engine.on_recorded = lambda frame: reported(frame.seq + 1, claimed)
        start_ns = 0
        try:
            for cycle in engine:
                if result.reference is None:
                    start_ns = _take_reference(result, line)
                _take(result, cycle, start_ns)
        finally:
            engine.events.close()
            result.frames = engine.recorded
            result.renewed = list(line.renewed)
            result.failures = [(refusal.seq, refusal.reason) for refusal in line.gate.refusals]
            if result.reference is None:
                _take_reference(result, line)
        if result.reference is None:
            raise DataError(f"{result.source}: {_no_reference(result, config.tactile.reference_frames)}")
    except LsdsError as error:
        result.error = naming(result.source, error)
        result.cause = error.__cause__
    return result


def _no_reference(result: TrackResult, wanted: int) -> str:
    if result.failures:
        number, reason = result.failures[0]
        why = reason.removeprefix(f"frame {number}: ")
        return f"none of {result.frames} frames can be the reference; frame {number}: {why}"
    remedy = "lower tactile.reference_frames" if wanted > 1 else "record one frame of the untouched gel"
    return f"{result.frames} frames, but the reference takes {wanted} equally bright in a row ({remedy})"


def only_watching(config: RigConfig) -> RigConfig:
    """Return the configuration with only its first sensor and its algorithms."""
    none = {kind: BackendSection(backend=NO_DEVICE) for kind in ("gripper", "arm", "pose_source", "cell")}
    alone = {"sensor": config.section("sensor"), "sensors": {}, "job": own_section("watch"), "clock": "auto"}
    return config.model_copy(update=none | alone)


def _take_reference(result: TrackResult, line: FingerLine) -> int:
    """Put the reference into the result; return its time (ns)."""
    result.reference, result.reference_frame = line.perception.reference, line.perception.reference_frame
    result.metres_per_px = line.perception.metres_per_px
    if result.reference_frame is not None and lamps_are_turned(result.reference_frame.image):
        result.notes.append(
            "the light comes from other sides than in a GelSight Mini: contact and imprint are wrong, most slips are "
            "missed (if the images are turned by 90 degrees, turn them back)"
        )
    return 0 if result.reference_frame is None else result.reference_frame.t_ns


def _take(result: TrackResult, cycle: Cycle, start_ns: int) -> None:
    """Add one frame to the result."""
    frame, tracks, observation = cycle.frame, cycle.tracks, cycle.observation
    result.t_s.append((frame.t_ns - start_ns) * 1e-9)
    result.kept_fraction.append(float(tracks.valid.mean()))
    result.flags += np.bincount(tracks.flags, minlength=len(TrackFlag))
    result.displacement_m.append(observation.field.displacement_m)
    result.features.append(observation.features.values)
    result.slip.append(cycle.detection.slip)
    result.speed_m_s.append(cycle.estimate.speed_m_s)
    result.speed_std_m_s.append(cycle.estimate.speed_std_m_s)
    moved = observation.features["mean_displacement"]
    if moved > result.largest_m:
        result.largest_m, result.worst = moved, (frame, tracks, observation.field.reference)


@contextmanager
def _explained(place: str) -> Iterator[None]:
    """Convert an unexpected exception into a DataError, so that a plugin's bug ends only one recording."""
    try:
        yield
    except LsdsError:
        raise
    except Exception as error:
        raise DataError(f"{place}: {type(error).__name__}: {error}") from error
