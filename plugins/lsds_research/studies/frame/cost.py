"""Computing time of one frame from image to command, and speed against accuracy of the tracker.

All candidates see the same frames of one simulated run, in turns, so that a noisy machine disturbs all alike; medians
are quoted. Peers are common designs: OpenCV's blob detector matched to the nearest dot, and pyramidal
Lucas-Kanade from frame to frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from lsds.clock import perf_ns
from lsds.config import load_config
from lsds.contracts import FingerCycle, Frame, GripEstimate, GripTask
from lsds.errors import DataError
from lsds.grip.observer import GripObserver
from lsds.registry import PluginHost
from lsds.runtime.engine import Engine
from lsds.runtime.quiet import quiet_process
from lsds.runtime.rig import Rig
from lsds.support.extras import importable
from lsds.tactile.compiled import use_compiled
from lsds.tactile.depth import DepthEstimator
from lsds.tactile.features import FeatureExtractor
from lsds.tactile.field import FieldBuilder
from lsds.tactile.imprint.layers import Layers
from lsds.tactile.imprint.motion import best_of, carried_gel
from lsds.tactile.imprint.registration import Registration
from lsds.tactile.imprint.relief import ReliefMaker
from lsds.tactile.imprint.residue import DotResidue
from lsds.tactile.perception import Perception
from lsds.tactile.views import Viewer
from lsds_research.studies.frame.peer_chain import NEEDS, PeerChain, PeerModels
from lsds_research.studies.frame.peers import BlobNearest, PyramidFlow

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.config import RigConfig
    from lsds.contracts import DeformationField

TRACKERS = ("lk", "centroid", "dis")
#: Factors by which the image is reduced for the estimate of depth; chosen.
SCALES = (4, 8, 16)
#: Single jumps that a tracker must follow or flag, from half a pitch on (px).
JUMPS_PX = (18, 24, 30, 36, 41)
#: Squeeze that the belief gets (m).
SQUEEZE_M = 1.5e-3
#: A track this far from the truth is on another marker (px).
WRONG_PX = 3.0


@dataclass(frozen=True, slots=True)
class Cost:
    """Median and 99th percentile of one part's time, microseconds, over `runs` calls."""

    name: str
    p50_us: float
    p99_us: float
    runs: int


@dataclass(frozen=True, slots=True)
class TrackerScore:
    """Speed and accuracy of one tracker on the same frames. `rms_px` is over right tracks, one axis.

    `wrong_unflagged` is over the run; `jump_wrong_unflagged` over single jumps of half a pitch and more, the share of
    markers that are on another's dot and not flagged; `jump_right` the share followed to the right dot.
    """

    name: str
    peer: bool
    p50_us: float
    p99_us: float
    rms_px: float
    kept_fraction: float
    wrong_unflagged: float
    jump_wrong_unflagged: float
    jump_right: float


@dataclass(frozen=True, slots=True)
class FrameCost:
    """Result of `measure`. `area_change` is each depth scale's mean area difference to the finest scale.

    `portable` is the total without compiled functions, None if numba is missing. `peers` are whole chains of common
    libraries, empty if the libraries are not installed. All are timed in turns with ours. `peer_ratio` is the median of
    the fastest peer over ours, None without any.
    """

    total: Cost
    portable: Cost | None
    peers: tuple[Cost, ...]
    peer_ratio: float | None
    parts: tuple[Cost, ...]
    trackers: tuple[TrackerScore, ...]
    depth: tuple[Cost, ...]
    area_change: tuple[float, ...]
    frames: int
    seed: int


@dataclass(frozen=True, slots=True, eq=False)
class Clip:
    """Frames of one run with the true dot positions (N, 2) px of each; the first frame is untouched."""

    reference: Frame
    rest_px: NDArray[np.float64]
    frames: tuple[Frame, ...]
    truth_px: tuple[NDArray[np.float64], ...]


def measure(seed: int = 0, repeats: int = 10, progress: Callable[[], object] | None = None) -> FrameCost:
    """Run the simulated cell once, then time every part on its frames `repeats` times.

    Raises DataError if the default sensor does not provide the true positions of its markers.
    """
    # As in a running engine, for all candidates.
    with quiet_process():
        return _measure(seed, repeats, progress)


def _measure(seed: int, repeats: int, progress: Callable[[], object] | None) -> FrameCost:
    host = PluginHost()
    config = load_config(None, [f"seed={seed}"], host=host)
    plain = load_config(None, [f"seed={seed}", "tactile.arithmetic=portable"], host=host)
    compiled = use_compiled(config.tactile.arithmetic)
    clip = record(config, host)
    portable: list[int] = []
    parts: dict[str, list[int]] = {}
    trackers: dict[str, list[int]] = {}
    depth: dict[int, list[int]] = {scale: [] for scale in SCALES}
    areas: dict[int, list[float]] = {scale: [] for scale in SCALES}
    scores: dict[str, tuple[float, float, float]] = {}
    jumps = {name: _jumps(tracker, clip) for name, tracker in _candidates(config, host).items()}
    chains = _peer_chains(config, host, clip)
    peers: dict[str, list[int]] = {}
    for _ in range(repeats):
        for name, samples in _time_parts(config, host, clip).items():
            parts.setdefault(name, []).extend(samples)
        if compiled:
            portable += _time_parts(plain, host, clip, steps=False)[_WHOLE]
        for name, make in chains.items():
            peers.setdefault(name, []).extend(_time_chain(make(), clip))
        for name, tracker in _candidates(config, host).items():
            times, scores[name] = _time_tracker(tracker, clip)
            trackers.setdefault(name, []).extend(times)
        for scale in SCALES:
            times, areas[scale] = _time_depth(clip, scale, config.tactile.contact_threshold_mm * 1e-3)
            depth[scale].extend(times)
        if progress is not None:
            progress()
    finest = np.array(areas[SCALES[0]])
    total = _cost(_WHOLE, parts.pop(_WHOLE))
    whole = tuple(_cost(name, samples) for name, samples in peers.items())
    return FrameCost(
        total=total,
        portable=_cost(f"{_WHOLE}, portable", portable) if portable else None,
        peers=whole,
        peer_ratio=min(peer.p50_us for peer in whole) / total.p50_us if whole else None,
        parts=tuple(_cost(name, samples) for name, samples in parts.items()),
        trackers=tuple(
            TrackerScore(
                name, name not in TRACKERS, _cost(name, t).p50_us, _cost(name, t).p99_us, *scores[name], *jumps[name]
            )
            for name, t in trackers.items()
        ),
        depth=tuple(_cost(f"depth at 1/{scale}", samples) for scale, samples in depth.items()),
        area_change=tuple(float(np.abs(np.array(areas[scale]) - finest).mean()) for scale in SCALES),
        frames=len(clip.frames),
        seed=seed,
    )


def record(config: RigConfig, host: PluginHost) -> Clip:
    """Run the loop and keep its frames with their truth."""
    frames: list[Frame] = []
    truth: list[NDArray[np.float64]] = []
    with Rig(config, host) as rig:
        sensor: Any = rig.sensor
        if not hasattr(sensor, "marker_truth"):
            raise DataError(
                f"sensor '{config.sensor.backend}' does not provide the true positions of its markers; use a mock"
            )
        rig.arm_devices()

        engine = Engine(rig)
        for cycle in engine:
            frames.append(cycle.frame)
            truth.append(sensor.marker_truth(cycle.frame.seq).xy_px)
        rest = sensor.marker_truth().rest_px
        reference = engine.perception.reference_frame
    if reference is None or not frames:
        raise DataError("the run produced no frames; check the config")
    return Clip(reference, rest, tuple(frames), tuple(truth))


_WHOLE = "image to command"


def _time_parts(config: RigConfig, host: PluginHost, clip: Clip, *, steps: bool = True) -> dict[str, list[int]]:
    """Return the times of the path of one frame through the loop, and of each of its `steps`."""
    rig = Rig(config, host)
    perception = Perception(rig.tracker, rig.sensor.spec, config.tactile)
    perception.start([clip.reference])
    samples: dict[str, list[int]] = {}

    def lap(name: str, since: int) -> int:
        now = perf_ns()
        samples.setdefault(name, []).append(now - since)
        return now

    aperture = config.task.grip_aperture_m
    wanted = GripTask(resolution_m=rig.gripper.spec.resolution_m if rig.gripper is not None else 0.0)
    observer = GripObserver(config.grip, wanted.answer_s, compiled=use_compiled(config.tactile.arithmetic))
    for frame in clip.frames:
        frame = _fresh(frame)
        begun = perf_ns()
        observation, tracks = perception.observe(frame)
        t = lap("perception", begun)
        if observation.imprint is not None:
            # Detector and estimator share this step. It is timed separately, or the first user would seem to cost it.
            observation.imprint()
        t = lap("imprint", t)
        detection = rig.detector.update(observation)
        t = lap("detector", t)
        estimate = rig.estimator.update(observation)
        t = lap("estimator", t)
        finger = FingerCycle("left", frame, tracks, observation, detection, estimate)
        grip = observer.update(
            GripEstimate(
                t_ns=observation.t_ns,
                dt_s=observation.dt_s,
                detection=detection,
                estimate=estimate,
                fingers=(finger,),
                commanded_m=aperture,
                measured_m=aperture,
                aperture_m=aperture,
                touch_m=aperture + SQUEEZE_M,
            )
        )
        t = lap("grip belief", t)
        rig.controller.update(grip, wanted)
        lap("controller", t)
        lap(_WHOLE, begun)
    if steps:
        _time_steps(config, host, clip, lap)
        _time_imprint(config, host, clip, lap)
    return samples


def _time_steps(config: RigConfig, host: PluginHost, clip: Clip, lap: Callable[[str, int], int]) -> None:
    """The steps of perception; the views are shared by tracker and depth."""
    rig = Rig(config, host)
    tracker, spec = rig.tracker, rig.sensor.spec
    reference = tracker.start(clip.reference, spec.pad)
    field, features = FieldBuilder(reference, spec.metres_per_px), FeatureExtractor()
    compiled = use_compiled(config.tactile.arithmetic)
    depth = DepthEstimator(clip.reference, spec.metres_per_px, scale=config.tactile.depth_scale, compiled=compiled)
    viewer = Viewer()
    for frame in clip.frames:
        frame = _fresh(frame)
        t = perf_ns()
        views = viewer.view(frame)
        _ = views.dark, views.half_planes if compiled else views.half_rgb
        lap("  views", t)
        t = perf_ns()
        frame = viewer.view(frame)
        tracks = tracker.update(frame)
        t = lap("  tracker (with its views)", t)
        built = field.build(tracks)
        t = lap("  field", t)
        contact = depth.measure(frame)
        t = lap("  depth and contact", t)
        features.extract(built, contact)
        lap("  features", t)


def _time_imprint(config: RigConfig, host: PluginHost, clip: Clip, lap: Callable[[str, int], int]) -> None:
    """The steps of the imprint, on frames with computed views and fields."""
    rig = Rig(config, host)
    spec = rig.sensor.spec
    perception = Perception(rig.tracker, spec, config.tactile)
    reference = perception.start([clip.reference])
    compiled = use_compiled(config.tactile.arithmetic)
    maker = ReliefMaker(compiled=compiled)
    residue = DotResidue(reference, maker.relief(clip.reference), spec.metres_per_px)
    before: tuple[Layers, DeformationField] | None = None
    for frame in clip.frames:
        observation, _ = perception.observe(_fresh(frame))
        seen, field = observation.frame or frame, observation.field
        t = perf_ns()
        relief = residue.taken_off(maker.relief(seen), field)
        layers = Layers(relief, compiled=compiled)
        t = lap("  imprint: relief", t)
        edges = layers[0].edges
        t = lap("  imprint: edges", t)
        if before is not None and len(edges):
            first, earlier = before
            gel = carried_gel(earlier, field, spec.metres_per_px, compiled=compiled)
            t = lap("  imprint: gel carried along", t)
            if gel is not None:
                registration = Registration(first, layers, gel, first[0].edges.centre, relief.scale)
                rest = registration.at_rest()
                if rest is not None:
                    best_of(registration, rest.seen, ())
                lap("  imprint: registration", t)
        before = layers, field


def _candidates(config: RigConfig, host: PluginHost) -> dict[str, Any]:
    rig = Rig(config, host)
    ours = {name: host.build("tracker", host.own("tracker", name), {}, rig.context) for name in TRACKERS}
    return {**ours, "blobs, nearest": BlobNearest(), "pyramidal LK": PyramidFlow()}


def _peer_chains(config: RigConfig, host: PluginHost, clip: Clip) -> dict[str, Callable[[], PeerChain]]:
    """Return the factory of each peer chain; none if a library is not installed."""
    if not all(importable(name) for name in NEEDS):
        return {}
    rig = Rig(config, host)
    spec = rig.sensor.spec
    perception = Perception(rig.tracker, spec, config.tactile)
    perception.start([clip.reference])
    models = PeerModels(host, clip.frames, perception)

    def chain(tracker: type[BlobNearest] | type[PyramidFlow]) -> Callable[[], PeerChain]:
        return lambda: PeerChain(tracker(), models, spec, config, clip.reference)

    return {
        "pyramidal LK, forest, LSTM": chain(PyramidFlow),
        "blobs, forest, LSTM": chain(BlobNearest),
    }


def _time_chain(chain: PeerChain, clip: Clip) -> list[int]:
    times = []
    for frame in clip.frames:
        frame = _fresh(frame)
        begun = perf_ns()
        chain.answer(frame)
        times.append(perf_ns() - begun)
    return times


def _time_tracker(tracker: Any, clip: Clip) -> tuple[list[int], tuple[float, float, float]]:
    """Times, and (RMS px, kept fraction, wrong and unflagged fraction) against the truth."""
    reference = tracker.start(clip.reference)
    at = reference.xy_px
    nearest = np.hypot(*(at[:, None, :] - clip.rest_px[None, :, :]).transpose(2, 0, 1)).argmin(axis=1)
    on_dots = np.hypot(*(at - clip.rest_px[nearest]).T) < WRONG_PX
    # The truth of sample points between markers (dense flow) is the motion of the nearest markers.
    times, errors, kept = [], [], []
    for frame, truth in zip(clip.frames, clip.truth_px, strict=True):
        frame = _fresh(frame)
        begun = perf_ns()
        tracks = tracker.update(frame)
        times.append(perf_ns() - begun)
        moved = (truth - clip.rest_px)[nearest]
        error = np.abs(tracks.xy_px - at - moved)
        errors.append(error[tracks.valid & on_dots] if on_dots.any() else error[tracks.valid])
        kept.append(float(tracks.valid.mean()))
    error = np.concatenate(errors)
    wrong = error.max(axis=1) > WRONG_PX
    right = error[~wrong]
    rms = float(np.sqrt((right**2).mean())) if len(right) else math.nan
    return times, (rms, float(np.mean(kept)), float(wrong.mean()) if len(wrong) else 0.0)


def _jumps(tracker: Any, clip: Clip) -> tuple[float, float]:
    """Shares of markers wrong and unflagged, and right, after the whole untouched image has jumped once."""
    wrong = right = total = 0
    height, width = clip.reference.image.shape[:2]
    for distance in JUMPS_PX:
        for turn in range(8):
            shift = distance * np.array([math.cos(turn * math.pi / 4), math.sin(turn * math.pi / 4)])
            move = np.hstack([np.eye(2), shift[:, None]])
            image = cv2.warpAffine(clip.reference.image, move, (width, height), borderMode=cv2.BORDER_REPLICATE)
            reference = tracker.start(clip.reference)
            tracker.update(Frame(clip.reference.image, 0, 0))
            tracks = tracker.update(Frame(np.asarray(image, np.uint8), 40_000_000, 1))
            off = np.abs(tracks.xy_px - reference.xy_px - shift).max(axis=1)
            wrong += int(np.count_nonzero(tracks.valid & (off > WRONG_PX)))
            right += int(np.count_nonzero(tracks.valid & (off <= WRONG_PX)))
            total += reference.count
    return wrong / total, right / total


def _time_depth(clip: Clip, scale: int, threshold_m: float) -> tuple[list[int], list[float]]:
    depth = DepthEstimator(clip.reference, 62.5e-6, scale=scale, threshold_m=threshold_m, compiled=use_compiled("auto"))
    times, areas = [], []
    for frame in clip.frames:
        frame = _fresh(frame)
        begun = perf_ns()
        areas.append(depth.measure(frame).area_fraction)
        times.append(perf_ns() - begun)
    return times, areas


def _fresh(frame: Frame) -> Frame:
    """Return the same image as a new frame, without cached results."""
    return Frame(frame.image, frame.t_ns, frame.seq)


def _cost(name: str, samples_ns: Sequence[int]) -> Cost:
    p50, p99 = np.percentile(samples_ns, [50, 99]) / 1e3
    return Cost(name, float(p50), float(p99), len(samples_ns))
