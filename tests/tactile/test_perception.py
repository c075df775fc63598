"""From frames to observations: streaming equals offline, reset clears the state, results are causal."""

from __future__ import annotations

import gc
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from lsds_plugins.detectors.rigid_residual import RigidResidualDetector, RigidResidualOptions
from lsds_plugins.detectors.threshold import ThresholdDetector, ThresholdOptions
from lsds_plugins.estimators.field import FieldEstimator, FieldOptions
from lsds_plugins.trackers.dis import DenseFlowOptions, DenseFlowTracker
from lsds_plugins.trackers.dotted.backends import centroid, lucas_kanade
from tactile.cell_frames import grasp_and_lift

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext, Frame, Observation
from lsds.errors import DataError
from lsds.tactile.field import FieldBuilder
from lsds.tactile.options import TactileOptions
from lsds.tactile.perception import Perception
from lsds.tactile.reference import ReferenceCollector, average_frames
from lsds.tactile.slip_residual import slip_residual
from lsds.tactile.views import Viewer, viewed

CONTEXT = BuildContext(VirtualClock(), 0)
TRACKERS = {
    "lk": lambda: lucas_kanade(None, CONTEXT),
    "centroid": lambda: centroid(None, CONTEXT),
    "dis": lambda: DenseFlowTracker(DenseFlowOptions(), CONTEXT),
}


@pytest.fixture(scope="module")
def recording():
    """(spec, reference frames, frames): a grasp and a lift with jitter, lost and repeated frames."""
    return grasp_and_lift(seed=3, count=36, drop_probability=0.1, duplicate_probability=0.1)


def perception(name, spec, reference):
    made = Perception(TRACKERS[name](), spec, TactileOptions())
    made.start(reference)
    return made


def copied(frame):
    return Frame(frame.image.copy(), frame.t_ns, frame.seq)


def numbers(observation, tracks):
    """Everything that an observation holds, copied now."""
    field, contact = observation.field, observation.contact
    parts = (
        tracks.xy_px,
        tracks.flags,
        field.position_m,
        field.displacement_m,
        field.velocity_m_s,
        field.valid,
        contact.depth_m,
        [contact.area_fraction, observation.dt_s, observation.t_ns, observation.seq],
        observation.features.values,
    )
    return [np.array(part) for part in parts]


def same(one, other):
    return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("name", sorted(TRACKERS))
def test_frame_by_frame_and_again_gives_the_same_bits(name, recording):
    spec, reference, frames = recording
    first = perception(name, spec, reference)
    streamed = [numbers(*first.observe(frame)) for frame in frames]
    # The second one works on copies, interleaved with a third that sees the frames in another order.
    second, other = (perception(name, spec, [copied(f) for f in reference]) for _ in range(2))
    for i, frame in enumerate(frames):
        other.observe(frames[-1 - i])
        assert same(streamed[i], numbers(*second.observe(copied(frame)))), f"frame {i}"


@pytest.mark.parametrize("name", sorted(TRACKERS))
def test_what_was_seen_does_not_change_when_more_is_seen(name, recording):
    spec, reference, frames = recording
    seen = perception(name, spec, reference)
    kept, now = [], []
    for frame in frames[:12]:
        kept.append(seen.observe(frame))
        now.append(numbers(*kept[-1]))
    for frame in reversed(frames[12:]):
        seen.observe(frame)
    for i, (observation, before) in enumerate(zip(kept, now, strict=True)):
        assert same(before, numbers(*observation)), f"frame {i} was overwritten"


@pytest.mark.parametrize("name", sorted(TRACKERS))
@pytest.mark.parametrize("cut", [1, 7, 20])
def test_the_present_does_not_depend_on_the_future(name, cut, recording):
    spec, reference, frames = recording
    one, other = perception(name, spec, reference), perception(name, spec, reference)
    futures = frames[cut:], frames[cut + 5 :] + frames[cut : cut + 5]
    pasts = []
    for seen, future in zip((one, other), futures, strict=True):
        pasts.append([numbers(*seen.observe(frame)) for frame in (*frames[:cut], *future)][:cut])
    assert all(same(a, b) for a, b in zip(*pasts, strict=True))


@pytest.mark.parametrize("name", sorted(TRACKERS))
def test_reset_forgets_everything_but_the_reference(name, recording):
    spec, reference, frames = recording
    used, fresh = perception(name, spec, reference), perception(name, spec, reference)
    for frame in frames[:17]:
        used.observe(frame)
    used.reset()
    for i, frame in enumerate(frames[4:20]):
        assert same(numbers(*used.observe(frame)), numbers(*fresh.observe(frame))), f"frame {i}"


def evidence(seen, frames):
    """Return the content of each frame's observation and of both its residuals, as numbers."""
    taken = []
    for frame in frames:
        observation, tracks = seen.observe(frame)
        residuals = [slip_residual(observation, motion) for motion in ("quadratic", "rigid")]
        taken.append([*numbers(observation, tracks), np.frombuffer(repr(residuals).encode(), np.uint8)])
    return taken


def rig(recording, mm_per_px):
    """Return a perception with its own scale, and copies of the frames, so that rigs share only the process."""
    spec, reference, frames = recording
    seen = Perception(TRACKERS["lk"](), spec, TactileOptions(mm_per_px=mm_per_px))
    seen.start([copied(frame) for frame in reference])
    return seen, [copied(frame) for frame in frames]


SCALES = (0.0625, 0.05)


def test_two_threads_do_not_disturb_each_other(recording):
    alone = [evidence(*rig(recording, scale)) for scale in SCALES]
    for _ in range(3):
        with ThreadPoolExecutor(2) as pool:
            together = list(pool.map(lambda scale: evidence(*rig(recording, scale)), SCALES))
        for one, other in zip(alone, together, strict=True):
            assert all(same(a, b) for a, b in zip(one, other, strict=True))


def test_views_are_computed_once_and_go_along_with_the_frame(recording):
    spec, reference, frames = recording
    seen = perception("lk", spec, reference)
    carried = seen.observe(frames[0])[0].frame
    assert carried.image is frames[0].image
    assert viewed(carried) is carried
    assert carried.half_rgb is carried.half_rgb
    # The colours of the next frame use the same room; what was computed from this one stays.
    grey = carried.grey.copy()
    seen.observe(frames[1])
    assert np.array_equal(carried.grey, grey)
    assert np.array_equal(viewed(frames[0]).grey, grey), "with or without its own buffers"


def test_two_rigs_in_one_thread_do_not_disturb_each_other(recording):
    alone = [evidence(*rig(recording, scale)) for scale in SCALES]
    rigs = [rig(recording, scale) for scale in SCALES]
    for i in range(len(alone[0])):
        for one, (seen, frames) in zip(alone, rigs, strict=True):
            [now] = evidence(seen, frames[i : i + 1])
            assert same(one[i], now), f"frame {i}"


def test_the_scale_is_part_of_what_a_residual_rests_on(recording):
    """The same reference and markers at two scales: lengths scale, and so do their residuals."""
    _, reference, frames = recording
    tracker = TRACKERS["lk"]()
    marks = tracker.start(average_frames(reference))
    fine, coarse = FieldBuilder(marks, 5e-5), FieldBuilder(marks, 1e-4)
    compared = 0
    for frame in frames:
        tracks = tracker.update(frame)
        small, large = (
            slip_residual(Observation(frame.t_ns, frame.seq, field.dt_s, field, None, None))
            for field in (fine.build(tracks), coarse.build(tracks))
        )
        if small is not None and large is not None:
            assert large.radius_m == pytest.approx(2 * small.radius_m)
            assert large.along == pytest.approx(4 * small.along)
            compared += 1
    assert compared > 10


ALGORITHMS = {
    "threshold": lambda: ThresholdDetector(ThresholdOptions(), CONTEXT),
    "rigid-residual": lambda: RigidResidualDetector(RigidResidualOptions(frames=3), CONTEXT),
    "field": lambda: FieldEstimator(FieldOptions(frames=4), CONTEXT),
}


@pytest.mark.parametrize("name", sorted(ALGORITHMS))
def test_algorithms_are_pure_and_reset_forgets(name, recording):
    spec, reference, frames = recording
    seen = perception("lk", spec, reference)
    observations = [seen.observe(frame)[0] for frame in frames]
    first, second = ALGORITHMS[name](), ALGORITHMS[name]()
    answers = [repr(first.update(o)) for o in observations]
    for _ in range(2):
        assert answers == [repr(second.update(o)) for o in observations]
        second.reset()


def test_every_feature_is_in_its_range(recording):
    spec, reference, frames = recording
    seen = perception("lk", spec, reference)
    defined = 0
    for frame in frames:
        features = seen.observe(frame)[0].features
        assert 0 <= features["area"] <= 1
        assert 0 <= features["entropy"] <= np.log(63)
        defined += int(np.isfinite(features.values).all())
    assert defined > len(frames) / 2


def test_the_displacement_is_the_simulated_gel_s():
    from tactile.cell_frames import CellBench

    bench = CellBench(5, jitter_ms=0.0)
    seen = perception("lk", bench.sensor.spec, bench.frames(5, 400))
    bench.grip(0.0236)
    errors = []
    for _ in bench.frames(10, 1300):
        observation, _ = seen.observe(bench.sensor.read())
        truth = bench.sensor.marker_truth()
        true_m = (truth.xy_px - truth.rest_px) * bench.sensor.spec.metres_per_px
        errors.append(observation.field.displacement_m - true_m)
    assert np.abs(true_m).max() > 5e-5, "nothing moved"
    assert np.sqrt(np.mean(np.square(errors))) < 0.06 * bench.sensor.spec.metres_per_px


@pytest.mark.parametrize(
    ("image", "reason"),
    [
        (np.zeros((240, 320), np.uint8), r"\(240, 320\)"),
        (np.zeros((240, 320, 3), np.float64), "float64"),
        (np.full((240, 320, 3), np.nan), "float64"),
        (np.zeros((120, 160, 3), np.uint8), r"\(120, 160, 3\)"),
        ([[1, 2], [3, 4]], "list"),
    ],
)
def test_a_frame_that_is_not_the_sensor_s_is_refused_by_name(image, reason, recording):
    spec, reference, _ = recording
    seen = perception("lk", spec, reference)
    with pytest.raises(DataError, match=f"frame 77: .*{reason}"):
        seen.observe(Frame(image, 10**12, 77))


@pytest.mark.parametrize(
    ("channels", "level", "reason"),
    [
        ([0, 2], 255, "saturated"),
        ([0], 255, "saturated"),
        ([1], 255, "saturated"),
        ([2], 255, "saturated"),
        ([0, 2], 0, "black"),
        ([0, 1, 2], 0, "black"),
    ],
)
def test_a_frame_without_the_colours_of_dots_or_contact_is_refused(channels, level, reason, recording):
    spec, reference, frames = recording
    seen = perception("lk", spec, reference)
    image = frames[0].image.copy()
    image[..., channels] = level
    with pytest.raises(DataError, match=f"frame 77: .*{reason}"):
        seen.observe(Frame(image, 10**12, 77))


def test_a_refused_frame_leaves_no_trace(recording):
    spec, reference, frames = recording
    used, fresh = perception("lk", spec, reference), perception("lk", spec, reference)
    for frame in frames[:8]:
        with pytest.raises(DataError):
            used.observe(Frame(np.zeros((2, 2, 3), np.uint8), frame.t_ns, frame.seq))
        assert same(numbers(*used.observe(frame)), numbers(*fresh.observe(frame)))


def test_the_reference_is_the_mean_of_its_frames():
    levels = [10, 11, 13]
    frames = [Frame(np.full((4, 4, 3), level, np.uint8), i, i) for i, level in enumerate(levels)]
    mean = average_frames(frames)
    assert (mean.image == 11).all()
    assert (mean.t_ns, mean.seq) == (2, 2)
    with pytest.raises(DataError, match="no frame"):
        average_frames([])
    with pytest.raises(DataError, match="different sizes"):
        average_frames([frames[0], Frame(np.zeros((2, 4, 3), np.uint8), 3, 3)])


def test_the_dim_first_frames_are_no_reference():
    collector = ReferenceCollector(3)
    brightness = [40, 70, 95, 100, 100, 101]
    enough = [collector.add(Frame(np.full((8, 8, 3), b, np.uint8), i, i)) for i, b in enumerate(brightness)]
    assert enough == [False, False, False, False, False, True]
    assert [frame.seq for frame in collector.frames] == [3, 4, 5]


def test_a_viewed_frame_goes_with_its_last_reference():
    gc.collect()
    gc.disable()
    try:
        viewer = Viewer()
        frame = viewer.view(Frame(np.zeros((48, 64, 3), np.uint8), 0, 0))
        assert frame.grey.shape == (48, 64)
        assert len(frame.half_planes) == 3
        gone = weakref.ref(frame)
        del frame
        assert gone() is None
    finally:
        gc.enable()
