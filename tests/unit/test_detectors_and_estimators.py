"""Detectors and the estimator on exactly known fields."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_plugins.detectors.rigid_residual import RigidResidualDetector, RigidResidualOptions
from lsds_plugins.detectors.threshold import ThresholdDetector, ThresholdOptions
from lsds_plugins.estimators.field import FieldEstimator, FieldOptions
from tactile.scenes import affine, make_reference, observation, positions_m

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.tactile.slip_residual import ContactMarkers, confidence, slip_residual

CONTEXT = BuildContext(VirtualClock(), 0)
REFERENCE = make_reference()
POSITION = positions_m(REFERENCE)
SHEAR_Y = np.tile([0.0, -3e-4], (REFERENCE.count, 1))
small = st.floats(-0.5, 0.5)
seeds = st.integers(0, 10_000)


def threshold(**options):
    return ThresholdDetector(ThresholdOptions(**options), CONTEXT)


def residual(**options):
    return RigidResidualDetector(RigidResidualOptions(**options), CONTEXT)


def estimator(**options):
    return FieldEstimator(FieldOptions(**options), CONTEXT)


def noise(seed, size=1e-4):
    return size * np.random.default_rng(seed).standard_normal((REFERENCE.count, 2))


def slip_along(shear, seed, size=2e-4):
    """Return velocities of markers that slip one by one: random along the shear, zero across it."""
    direction = shear / np.linalg.norm(shear, axis=1, keepdims=True)
    return size * np.random.default_rng(seed).standard_normal((len(shear), 1)) * direction


# -- threshold ---------------------------------------------------------------------------------------------


@given(st.lists(st.one_of(st.just(math.nan), st.floats(0, 1e-2)), min_size=1, max_size=20), st.floats(1e-5, 5e-3))
def test_the_rule_is_the_maximum_of_two_frames(speeds, limit):
    detector, last = threshold(v_net_m_s=limit), math.nan
    for speed in speeds:
        detection = detector.update(observation(None, v_net=speed))
        known = [v for v in (speed, last) if not math.isnan(v)]
        last = speed
        if not known:
            assert detection.slip is None
            assert math.isnan(detection.score)
            assert detection.confidence == 0
            continue
        assert detection.score == max(known)
        assert detection.slip == (max(known) > limit)
        assert detection.threshold == limit
        assert 0 <= detection.confidence <= 1


def test_a_fast_frame_counts_for_two():
    detector = threshold(v_net_m_s=1e-3)
    speeds = [0.0, 2e-3, 0.0, 0.0]
    assert [detector.update(observation(None, v_net=v)).slip for v in speeds] == [False, True, True, False]


def test_reset_forgets_the_last_frame():
    detector = threshold(v_net_m_s=1e-3)
    detector.update(observation(None, v_net=2e-3))
    detector.reset()
    assert detector.update(observation(None, v_net=math.nan)).slip is None


@given(st.floats(0, 1), st.floats(1e-6, 1))
def test_confidence_is_a_share_and_nothing_at_the_threshold(score, limit):
    assert 0 <= confidence(score, limit) <= 1
    assert confidence(limit, limit) == 0
    assert confidence(2 * limit, limit) == pytest.approx(0.8)
    assert confidence(limit / 2, limit) == pytest.approx(0.8)


# -- rigid-residual ----------------------------------------------------------------------------------------


@given(
    small, small, small, small, st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.sampled_from(["affine", "quadratic"])
)
def test_affine_motion_leaves_no_residual(a, b, c, d, vx, vy, motion):
    field = affine(POSITION, [[a, b], [c, d]], (vx / 10, vy / 10))
    detection = residual(motion=motion).update(observation(field, displacement_m=SHEAR_Y))
    assert detection.score < 1e-6
    assert detection.slip is False


@given(small, st.floats(-0.05, 0.05), st.floats(-0.05, 0.05))
def test_rigid_motion_leaves_no_residual_under_any_model(w, vx, vy):
    field = affine(POSITION, [[0, -w], [w, 0]], (vx, vy))
    for motion in ("rigid", "affine", "quadratic"):
        assert residual(motion=motion).update(observation(field, displacement_m=SHEAR_Y)).score < 1e-6


@given(small, seeds)
def test_stretching_is_slip_to_the_rigid_model_only(stretch, seed):
    stretch = math.copysign(0.2 + abs(stretch), stretch)
    seen = observation(affine(POSITION, [[0, 0], [0, stretch]]), displacement_m=SHEAR_Y)
    assert residual(motion="rigid").update(seen).slip
    assert residual(motion="affine").update(seen).slip is False


@settings(max_examples=30)
@given(seeds, st.lists(st.floats(0, 5e-3), min_size=2, max_size=6))
def test_the_score_grows_with_the_slip_that_is_added(seed, sizes):
    """One pattern of slip along the shear, scaled: the score is proportional to it."""
    carried, pattern = affine(POSITION, [[0.1, 0], [0, -0.1]], (0.01, 0.0)), slip_along(SHEAR_Y, seed, 1.0)
    sizes = sorted(sizes)
    scores = [residual().update(observation(carried + size * pattern, displacement_m=SHEAR_Y)).score for size in sizes]
    assert all(a <= b + 1e-9 for a, b in pairwise(scores))
    unit = residual().update(observation(pattern, displacement_m=SHEAR_Y)).score
    assert scores == pytest.approx([size * unit for size in sizes], abs=1e-6)
    assert unit > 0.3


def test_slip_along_the_shear_is_found_and_jitter_across_it_is_not():
    along = slip_along(SHEAR_Y, 1)
    assert residual().update(observation(along, displacement_m=SHEAR_Y)).slip
    across = along[:, ::-1].copy()
    detection = residual().update(observation(across, displacement_m=SHEAR_Y))
    assert detection.score == 0
    assert detection.slip is False


def test_jitter_alike_in_all_directions_cancels_on_average():
    excess = [slip_residual(observation(noise(s), displacement_m=SHEAR_Y)) for s in range(200)]
    along, across = (np.mean([getattr(e, side) for e in excess]) for side in ("along", "across"))
    # The residual is scaled to the noise's own variance: 1e-4 squared along, the same across.
    assert along == pytest.approx(1e-8, rel=0.05)
    assert across == pytest.approx(1e-8, rel=0.05)


def test_pooling_averages_the_squares_of_the_last_frames():
    detector, single = residual(frames=3), residual()
    seen = [observation(slip_along(SHEAR_Y, s, s * 1e-4), displacement_m=SHEAR_Y) for s in range(1, 6)]
    scores = [single.update(o).score for o in seen]
    pooled = [detector.update(o).score for o in seen]
    for i, score in enumerate(pooled):
        window = scores[max(0, i - 2) : i + 1]
        assert score == pytest.approx(math.sqrt(np.mean(np.square(window))))


@pytest.mark.parametrize("make", [residual, threshold])
def test_detectors_abstain_without_a_velocity(make):
    detection = make().update(observation(None))
    assert detection.slip is None
    assert math.isnan(detection.score)
    assert detection.confidence == 0


def test_a_dot_that_was_lost_and_is_found_again_costs_its_own_velocity_only():
    velocity = slip_along(SHEAR_Y, 3)
    whole = slip_residual(observation(velocity, displacement_m=SHEAR_Y))
    one = velocity.copy()
    one[20] = math.nan
    found = slip_residual(observation(one, displacement_m=SHEAR_Y))
    assert found.markers == whole.markers - 1
    for name in ("along", "across", "translation", "excess"):
        assert math.isfinite(getattr(found, name))
    assert found.along == pytest.approx(whole.along, rel=0.3)
    assert residual().update(observation(one, displacement_m=SHEAR_Y)).score > 0


def test_the_residual_abstains_with_few_markers_and_starts_afresh():
    detector = residual(frames=5)
    slipping = slip_along(SHEAR_Y, 1, 1e-3)
    assert detector.update(observation(slipping, displacement_m=SHEAR_Y)).slip
    lost = np.arange(63) >= 5
    assert detector.update(observation(slipping, displacement_m=SHEAR_Y, lost=lost)).slip is None
    assert detector.update(observation(0 * slipping, displacement_m=SHEAR_Y)).slip is False


def test_only_markers_in_contact_have_a_say():
    depth = np.zeros((30, 40), np.float32)
    depth[:, 12:28] = 3e-4
    inside = (REFERENCE.xy_px[:, 0] >= 96) & (REFERENCE.xy_px[:, 0] < 224)
    free = np.where(inside[:, None], 0.0, slip_along(SHEAR_Y, 3, 1e-2))
    seen = observation(free, displacement_m=SHEAR_Y, depth_m=depth, reference=REFERENCE)
    markers = ContactMarkers(REFERENCE)
    assert np.array_equal(markers.in_contact(seen.field.valid, seen.contact, 6), inside)
    assert residual().update(seen).slip is False
    untouched = observation(free, displacement_m=SHEAR_Y, depth_m=np.zeros((30, 40), np.float32), reference=REFERENCE)
    touching = markers.in_contact(untouched.field.valid, untouched.contact, 6)
    assert touching.all(), "too small a contact is no reason to look at nothing"


# -- field -------------------------------------------------------------------------------------------------


@given(small, st.floats(-0.02, 0.02), st.floats(-0.02, 0.02))
def test_an_object_that_is_carried_along_does_not_slip(w, vx, vy):
    estimate = estimator().update(observation(affine(POSITION, [[0, -w], [w, 0]], (vx, vy)), displacement_m=SHEAR_Y))
    assert not estimate.abstained
    assert estimate.speed_m_s < 1e-3
    assert math.hypot(*estimate.velocity_m_s) < 1e-3


@settings(max_examples=40)
@given(st.floats(-math.pi, math.pi), seeds)
def test_the_direction_is_that_of_the_shear(angle, seed):
    way = np.array([math.cos(angle), math.sin(angle)])
    shear = np.tile(3e-4 * way, (63, 1))
    velocity = slip_along(shear, seed) + 2e-3 * way
    estimate = estimator().update(observation(velocity, displacement_m=shear))
    assert estimate.speed_m_s > 1e-3
    speed = np.array(estimate.velocity_m_s)
    assert speed / np.linalg.norm(speed) == pytest.approx(way, abs=1e-6)
    assert np.linalg.norm(speed) == pytest.approx(estimate.speed_m_s, rel=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_torsional_slip_is_a_rotation_with_the_sense_of_the_twist(sign):
    offset = POSITION - POSITION.mean(axis=0)
    turned = np.stack([-offset[:, 1], offset[:, 0]], axis=1)
    shear = sign * 0.05 * turned
    velocity = sign * 0.5 * turned + slip_along(shear, 4)
    estimate = estimator().update(observation(velocity, displacement_m=shear))
    assert estimate.angular_rad_s * sign > 0.1
    radius = math.sqrt((offset**2).sum() / 63)
    rim = abs(estimate.angular_rad_s) * radius
    assert rim > 5e-3
    assert estimate.speed_m_s < 0.05 * rim, "it is all rotation"


def test_linear_slip_is_hardly_a_rotation():
    estimate = estimator().update(observation(slip_along(SHEAR_Y, 4) + np.array([0.0, -5e-3]), displacement_m=SHEAR_Y))
    radius = math.sqrt((POSITION**2).sum() / 63)
    assert abs(estimate.angular_rad_s) * radius < 0.2 * estimate.speed_m_s


def test_the_speed_is_proportional_to_the_residual_and_to_the_gain():
    seen = [observation(slip_along(SHEAR_Y, 5, size), displacement_m=SHEAR_Y) for size in (1e-4, 3e-4)]
    one, three = (estimator().update(o).speed_m_s for o in seen)
    assert three == pytest.approx(3 * one, rel=1e-3)
    assert estimator(gain=50.0).update(seen[0]).speed_m_s == pytest.approx(one / 2, rel=1e-6)


def test_the_window_averages():
    loud, quiet = (
        observation(slip_along(SHEAR_Y, s, size), displacement_m=SHEAR_Y) for s, size in ((6, 4e-4), (7, 0.0))
    )
    alone = estimator(frames=1)
    first = alone.update(loud).speed_m_s
    assert alone.update(quiet).speed_m_s < 1e-3 * first
    windowed = estimator(frames=4)
    windowed.update(loud)
    for i in (2, 3, 4):
        assert windowed.update(quiet).speed_m_s == pytest.approx(first / math.sqrt(i), rel=1e-3)
    assert windowed.update(quiet).speed_m_s < 1e-3 * first, "the window is four frames long"


def test_the_uncertainty_grows_with_jitter_with_the_gain_s_spread_and_with_fewer_markers():
    slipping = slip_along(SHEAR_Y, 8)

    def spread(size=0.0, lost=None, **options):
        seen = observation(slipping + noise(9, size), displacement_m=SHEAR_Y, lost=lost)
        return estimator(frames=1, **options).update(seen)

    by_gain = [spread(gain_log_std=s).speed_std_m_s for s in (0.1, 0.4, 0.8)]
    assert by_gain == sorted(by_gain)
    assert by_gain[0] < by_gain[-1] / 4
    floors = [spread(size, gain_log_std=0.0).speed_std_m_s for size in (0.0, 5e-5, 2e-4)]
    assert floors == sorted(floors)
    assert floors[1] > 10 * floors[0]
    few = np.random.default_rng(0).permutation(63) >= 16
    assert spread(2e-4, few, gain_log_std=0.0).speed_std_m_s > floors[2]


@settings(max_examples=40)
@given(seeds, st.floats(0, 1e-2), st.floats(0, 1e-2), st.integers(0, 57))
def test_estimates_are_finite_and_deviations_not_negative(seed, slip, jitter, lost):
    gone = np.random.default_rng(seed).permutation(63) < lost
    seen = observation(
        slip_along(SHEAR_Y, seed, slip) + noise(seed + 1, jitter), displacement_m=SHEAR_Y + noise(seed, 1e-5), lost=gone
    )
    estimate = estimator().update(seen)
    assert not estimate.abstained
    numbers = (
        *estimate.velocity_m_s,
        *estimate.velocity_std_m_s,
        estimate.angular_rad_s,
        estimate.angular_std_rad_s,
        estimate.speed_m_s,
        estimate.speed_std_m_s,
    )
    assert all(map(math.isfinite, numbers))
    assert min(*estimate.velocity_std_m_s, estimate.angular_std_rad_s, estimate.speed_m_s, estimate.speed_std_m_s) >= 0


@pytest.mark.parametrize("kept", [0, 3, 5])
def test_the_estimator_abstains_with_few_markers_or_none(kept):
    estimate = estimator().update(observation(noise(1), displacement_m=SHEAR_Y, lost=np.arange(63) >= kept))
    assert estimate.abstained
    assert math.isnan(estimate.speed_m_s)


def test_the_estimator_abstains_without_a_velocity_and_forgets_what_was_before():
    used, fresh = estimator(frames=3), estimator(frames=3)
    used.update(observation(slip_along(SHEAR_Y, 1, 1e-3), displacement_m=SHEAR_Y))
    assert used.update(observation(None, displacement_m=SHEAR_Y)).abstained
    seen = observation(slip_along(SHEAR_Y, 2), displacement_m=SHEAR_Y)
    assert used.update(seen) == fresh.update(seen)
