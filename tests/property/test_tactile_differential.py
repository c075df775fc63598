"""Divergence, curl and the other features of exactly known fields."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile.scenes import CENTRE, PADS, SCALE, affine, features_of, make_reference, positions_m

from lsds.contracts import MarkerReference
from lsds.tactile.feature_sets import FEATURE_SETS, NAMES, feature_indices

pads = st.sampled_from(sorted(PADS))
angles = st.floats(-0.7, 0.7)
distortions = st.floats(-0.06, 0.08)
small = st.floats(-0.05, 0.05)
shifts = st.tuples(st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3))
seeds = st.integers(0, 10_000)
DIVERGENCES = ("div_mean", "div_affine")
CURLS = ("curl_mean", "curl_affine")
GRADIENT_FEATURES = ("div_sum", "curl_sum", *DIVERGENCES, *CURLS, "rotation")


def rough_field(reference, seed, size=2e-4):
    return size * np.random.default_rng(seed).standard_normal((reference.count, 2))


def moved(reference, matrix, cell=None):
    """The reference with its positions mapped by a matrix about the image's centre."""
    xy = (reference.xy_px - CENTRE) @ np.asarray(matrix).T + CENTRE
    cell = reference.cell if cell is None else cell
    return MarkerReference(xy, cell, reference.shape, reference.pitch_px, reference.axes, reference.image_size)


@given(pads, angles, distortions, shifts, seeds)
def test_pure_translation_has_neither_divergence_nor_curl(pad, angle, pincushion, shift, seed):
    reference = make_reference(pad, angle, pincushion, seed=seed)
    features = features_of(reference, np.tile(shift, (reference.count, 1)))
    for name in GRADIENT_FEATURES:
        assert abs(features[name]) < 1e-11 * reference.count, name


@given(pads, angles, distortions, st.floats(0, 1), small, small, small, small, shifts, seeds)
def test_affine_fields_give_their_analytic_divergence_and_curl(pad, angle, pincushion, jitter, a, b, c, d, shift, seed):
    reference = make_reference(pad, angle, pincushion, jitter, seed)
    features = features_of(reference, affine(positions_m(reference), [[a, b], [c, d]], shift))
    for name in DIVERGENCES:
        assert features[name] == pytest.approx(a + d, abs=1e-10), name
    for name in CURLS:
        assert features[name] == pytest.approx(c - b, abs=1e-10), name
    assert features["rotation"] == pytest.approx((c - b) / 2, abs=1e-10)
    assert features["div_sum"] == pytest.approx(reference.count * (a + d), abs=1e-8)
    assert features["curl_sum"] == pytest.approx(reference.count * (c - b), abs=1e-8)


@pytest.mark.parametrize("pad", sorted(PADS))
@pytest.mark.parametrize("angle", [0.0, 0.3, -0.69])
def test_expansion_and_rotation(pad, angle):
    reference = make_reference(pad, angle)
    x, y = positions_m(reference).T
    grown = features_of(reference, 0.02 * np.stack([x, y], axis=1))
    turned = features_of(reference, 0.03 * np.stack([-y, x], axis=1))
    assert grown["div_mean"] == pytest.approx(0.04)
    assert grown["curl_mean"] == pytest.approx(0, abs=1e-12)
    assert turned["curl_mean"] == pytest.approx(0.06)
    assert turned["div_mean"] == pytest.approx(0, abs=1e-12)
    # Clockwise on the screen (x right, y down) is positive.
    assert turned["rotation"] == pytest.approx(0.03)


@given(pads, angles, seeds, seeds, st.floats(-3, 3), st.floats(-3, 3))
def test_the_gradient_features_are_linear(pad, angle, one, two, p, q):
    reference = make_reference(pad, angle)
    u, v = rough_field(reference, one), rough_field(reference, two + 20_000)
    fu, fv, both = (features_of(reference, d) for d in (u, v, p * u + q * v))
    for name in GRADIENT_FEATURES:
        size = 1 + abs(p * fu[name]) + abs(q * fv[name])
        assert both[name] == pytest.approx(p * fu[name] + q * fv[name], abs=1e-9 * size), name


@given(pads, st.floats(-np.pi, np.pi), seeds)
def test_turning_the_whole_scene_changes_no_divergence_and_no_curl(pad, turn, seed):
    reference = make_reference(pad, seed=seed)
    field = rough_field(reference, seed)
    cos, sin = np.cos(turn), np.sin(turn)
    matrix = np.array([[cos, -sin], [sin, cos]])
    before = features_of(reference, 0 * field, field)
    after = features_of(moved(reference, matrix), 0 * field, field @ matrix.T)
    for name in (*GRADIENT_FEATURES, "entropy", "mean_speed", "v_net", "div_sum_rate", "curl_sum_rate"):
        assert after[name] == pytest.approx(before[name], rel=1e-8, abs=1e-9), name


@given(pads, angles, seeds)
def test_reflection_flips_the_sign_of_curl_and_keeps_divergence(pad, angle, seed):
    reference = make_reference(pad, angle, seed=seed)
    field = rough_field(reference, seed)
    matrix = np.diag([-1.0, 1.0])
    cell = reference.cell * [1, -1] + [0, pad[1] - 1]
    before, after = features_of(reference, field), features_of(moved(reference, matrix, cell), field @ matrix)
    for name in ("div_sum", *DIVERGENCES):
        assert after[name] == pytest.approx(before[name], rel=1e-8, abs=1e-10), name
    for name in ("curl_sum", *CURLS, "rotation"):
        assert after[name] == pytest.approx(-before[name], rel=1e-8, abs=1e-10), name


@given(pads, st.tuples(st.floats(-80, 80), st.floats(-80, 80)), seeds)
def test_where_on_the_image_the_pad_lies_does_not_matter(pad, shift, seed):
    here, there = make_reference(pad), make_reference(pad, shift=shift)
    field = rough_field(here, seed)
    for name in GRADIENT_FEATURES:
        assert features_of(there, field)[name] == pytest.approx(features_of(here, field)[name], rel=1e-7, abs=1e-9)


lost_shares = st.floats(0.0, 0.45)


def lose(reference, share, seed):
    return np.random.default_rng(seed).permutation(reference.count) < int(share * reference.count)


@given(pads, angles, lost_shares, small, small, small, small, seeds)
def test_affine_fields_are_exact_whichever_markers_are_lost(pad, angle, share, a, b, c, d, seed):
    reference = make_reference(pad, angle)
    lost = lose(reference, share, seed)
    features = features_of(reference, affine(positions_m(reference), [[a, b], [c, d]]), lost=lost)
    for name in DIVERGENCES:
        assert features[name] == pytest.approx(a + d, abs=1e-10), name
    for name in CURLS:
        assert features[name] == pytest.approx(c - b, abs=1e-10), name
    assert features["div_sum"] == pytest.approx(reference.count * (a + d), abs=1e-8)


def worst_error(position, noise):
    """Largest error of div or curl of the affine fit where every vector is off by at most `noise`.

    The estimate is sum w_i . n_i with w_i = M^-1 (x_i - c), M = sum (x_i - c)(x_i - c)^T, and |n_i| <= noise, so its
    error is at most noise sum |w_i| <= noise sqrt(N sum |w_i|^2) = noise sqrt(N tr M^-1) (Cauchy-Schwarz).
    """
    offset = position - position.mean(axis=0)
    return noise * np.sqrt(len(position) * np.trace(np.linalg.inv(offset.T @ offset)))


@given(pads, angles, lost_shares, small, small, seeds)
def test_lost_markers_change_a_noisy_affine_fit_by_no_more_than_the_noise_allows(pad, angle, share, a, b, seed):
    reference = make_reference(pad, angle)
    position, noise = positions_m(reference), 5e-6
    lost = lose(reference, share, seed)
    direction = np.random.default_rng(seed).uniform(0, 2 * np.pi, reference.count)
    field = affine(position, [[a, -b], [b, a]]) + noise * np.stack([np.cos(direction), np.sin(direction)], axis=1)
    full, holes = features_of(reference, field), features_of(reference, field, lost=lost)
    bound_full, bound_holes = worst_error(position, noise), worst_error(position[~lost], noise)
    for name, truth in (("div_affine", 2 * a), ("curl_affine", 2 * b)):
        assert abs(holes[name] - truth) <= bound_holes, name
        assert abs(holes[name] - full[name]) <= bound_holes + bound_full, name


@given(pads, seeds, st.floats(0, 1e-2), lost_shares)
def test_entropy_lies_between_zero_and_the_logarithm_of_the_number_of_markers(pad, seed, size, share):
    reference = make_reference(pad)
    lost = lose(reference, share, seed)
    entropy = features_of(reference, rough_field(reference, seed, size), lost=lost)["entropy"]
    assert 0 <= entropy <= np.log(np.count_nonzero(~lost)) + 1e-12


@given(pads, shifts)
def test_entropy_of_markers_that_move_alike_is_zero(pad, shift):
    reference = make_reference(pad)
    # Half a bin off its edge: 63 rounded copies of one number must not straddle it.
    length = (np.floor(np.hypot(*shift) / 31.25e-6) + 0.5) * 31.25e-6
    direction = np.arctan2(shift[1], shift[0])
    same = np.tile([length * np.cos(direction), length * np.sin(direction)], (reference.count, 1))
    assert features_of(reference, same)["entropy"] == pytest.approx(0, abs=1e-12)


def test_entropy_of_markers_each_in_a_bin_of_its_own_is_the_logarithm_of_their_number():
    reference = make_reference((7, 9))
    spread = np.stack([(np.arange(63) + 0.5) * 31.25e-6, np.zeros(63)], axis=1)
    assert features_of(reference, spread)["entropy"] == pytest.approx(np.log(63))


@settings(max_examples=30)
@given(seeds, st.floats(5, 200))
def test_rates_divide_by_the_measured_interval(seed, dt_ms):
    reference = make_reference()
    before, after = rough_field(reference, seed), rough_field(reference, seed + 20_000)
    dt_ms = round(dt_ms)
    first, second = features_of(reference, before), features_of(reference, before, after, dt_ms=dt_ms)
    dt_s = dt_ms * 1e-3
    for name in ("div_sum", "curl_sum", "entropy", "div_mean", "curl_mean"):
        assert second[f"{name}_rate"] == pytest.approx((second[name] - first[name]) / dt_s, rel=1e-9, abs=1e-12)
    velocity = (after - before) / dt_s
    assert second["v_x"] == pytest.approx(velocity[:, 0].mean())
    assert second["v_net"] == pytest.approx(np.hypot(*velocity.mean(axis=0)))
    assert second["mean_speed"] == pytest.approx(np.hypot(*velocity.T).mean())
    assert second["angular_velocity"] == pytest.approx((second["rotation"] - first["rotation"]) / dt_s)
    assert second["theta"] == pytest.approx(np.arctan2(*velocity.mean(axis=0)[::-1]))
    assert second["displacement_log2n"] == pytest.approx(np.log2(63) * np.hypot(*after.T).mean())
    assert second["displacement_log2n_delta"] == pytest.approx(
        second["displacement_log2n"] - first["displacement_log2n"]
    )


def test_the_paper_s_net_velocity_is_blind_to_rotation_and_the_mean_speed_is_not():
    reference = make_reference(jitter=0)
    x, y = positions_m(reference).T
    turn = 0.01 * np.stack([-y, x], axis=1)
    features = features_of(reference, 0 * turn, turn)
    assert features["v_net"] < 1e-12
    assert features["mean_speed"] > 1e-4


def test_what_one_frame_cannot_define_is_not_a_number():
    features = features_of(make_reference(), np.full((63, 2), 1e-4))
    undefined = {name for name in NAMES if np.isnan(features[name])}
    assert {"v_x", "v_net", "div_sum_rate", "entropy_rate", "angular_velocity", "theta", "area"} <= undefined
    assert not undefined & {"div_sum", "curl_sum", "entropy", "mean_displacement", "div_affine"}


def test_a_repeated_time_stamp_defines_no_rate():
    reference = make_reference()
    features = features_of(reference, np.zeros((63, 2)), np.full((63, 2), SCALE), dt_ms=0)
    for name in ("v_net", "mean_speed", "div_sum_rate", "entropy_rate"):
        assert np.isnan(features[name]), name


def test_fewer_than_half_of_the_markers_define_no_feature_of_the_field():
    reference = make_reference()
    features = features_of(reference, np.zeros((63, 2)), np.full((63, 2), SCALE), lost=np.arange(63) < 40)
    for name in (*GRADIENT_FEATURES, "entropy", "v_net", "mean_displacement"):
        assert np.isnan(features[name]), name


@pytest.mark.parametrize(("name", "size"), [("baseline", 2), ("proposed", 7), ("combined", 9), ("released13", 13)])
def test_the_named_sets_have_the_sizes_they_are_known_for(name, size):
    indices = feature_indices(name)
    assert len(indices) == len(set(indices)) == size
    assert tuple(NAMES[i] for i in indices) == FEATURE_SETS[name]
