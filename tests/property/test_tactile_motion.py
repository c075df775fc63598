"""Rigid, affine and smooth motions: least squares worked out by hand against NumPy's solver."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tactile.scenes import affine

from lsds.tactile.features import displacement_entropy
from lsds.tactile.motion_fit import fit_affine
from lsds.tactile.plane_motion import Points, as_complex, smooth_basis

seeds = st.integers(0, 100_000)
counts = st.integers(4, 80)


def scene(count, seed, size=1e-3):
    rng = np.random.default_rng(seed)
    position = rng.uniform(-0.01, 0.01, (count, 2)) + rng.uniform(-0.1, 0.1, 2)
    return position, size * rng.standard_normal((count, 2))


def rigid_by_numpy(position, vector):
    offset = position - position.mean(axis=0)
    design = np.zeros((2 * len(position), 3))
    design[0::2, 0] = design[1::2, 1] = 1
    design[0::2, 2], design[1::2, 2] = -offset[:, 1], offset[:, 0]
    solution = np.linalg.lstsq(design, vector.ravel(), rcond=None)[0]
    return solution, (vector.ravel() - design @ solution).reshape(-1, 2)


def smooth_residual(offset, vector, motion):
    """Return the residual of the best smooth motion for the vectors (N, 2) at the offsets (N, 2)."""
    basis, scale = smooth_basis(as_complex(offset), motion)
    return (vector - basis @ (basis.T @ vector)) * scale


def rigid(points, plane):
    """Translation and rotation of the best rigid motion."""
    translation, turned = points.rigid_rows() @ plane
    return translation, turned.imag


@given(counts, seeds)
def test_the_rigid_fit_is_the_least_squares_solution(count, seed):
    position, vector = scene(count, seed)
    (tx, ty, w), residual = rigid_by_numpy(position, vector)
    points, plane = Points(as_complex(position)), as_complex(vector)
    translation, rotation = rigid(points, plane)
    assert translation == pytest.approx(complex(tx, ty), abs=1e-12)
    assert rotation == pytest.approx(w, rel=1e-8, abs=1e-9)
    assert plane - points.motion(translation, rotation) == pytest.approx(as_complex(residual), abs=1e-10)
    assert points.radius == pytest.approx(np.sqrt(position.var(axis=0).sum()))


@given(counts, seeds)
def test_the_affine_fit_is_the_least_squares_solution(count, seed):
    position, vector = scene(count, seed)
    offset = position - position.mean(axis=0)
    design = np.column_stack([np.ones(count), offset])
    solution = np.linalg.lstsq(design, vector, rcond=None)[0]
    fit = fit_affine(position, vector)
    size = np.abs(solution).max()
    assert fit.translation == pytest.approx(solution[0], abs=1e-7 * size)
    assert fit.gradient == pytest.approx(solution[1:].T, abs=1e-7 * size)
    assert fit.residual == pytest.approx(vector - design @ solution, abs=1e-9)
    assert fit.divergence == pytest.approx(np.trace(solution[1:]), abs=1e-7 * size)
    assert fit.curl == pytest.approx(solution[1, 1] - solution[2, 0], abs=1e-7 * size)


@given(st.integers(9, 80), seeds, st.sampled_from(["affine", "quadratic"]))
def test_the_smooth_residual_is_what_least_squares_leaves(count, seed, motion):
    position, vector = scene(count, seed)
    offset = position - position.mean(axis=0)
    x, y = (offset / np.abs(offset).max()).T
    terms = (x, y) if motion == "affine" else (x, y, x * x, x * y, y * y)
    design = np.column_stack([np.ones(count), *terms])
    left = vector - design @ np.linalg.lstsq(design, vector, rcond=None)[0]
    expected = left * np.sqrt(count / max(1, count - design.shape[1]))
    found = smooth_residual(offset, vector, motion)
    # The ridge of 1e-9 moves it by that share of a badly supported term.
    assert found == pytest.approx(expected, abs=1e-4 * np.abs(vector).max())


@given(st.integers(5, 80), seeds, st.floats(-0.02, 0.02), st.floats(-0.02, 0.02), st.floats(-1, 1))
def test_a_rigid_motion_leaves_nothing(count, seed, tx, ty, w):
    position, _ = scene(count, seed)
    centre = position.mean(axis=0)
    vector = affine(position - centre, [[0, -w], [w, 0]], (tx, ty))
    points = Points(as_complex(position))
    translation, rotation = rigid(points, as_complex(vector))
    assert translation == pytest.approx(complex(tx, ty), abs=1e-12)
    assert rotation == pytest.approx(w, abs=1e-9)
    assert points.motion(translation, rotation) == pytest.approx(as_complex(vector), abs=1e-10)
    left = smooth_residual(position - centre, vector, "affine")
    assert np.abs(left).max() < 1e-6 * max(1e-6, np.abs(vector).max())


def test_the_residual_of_pure_noise_estimates_its_variance_however_few_the_markers():
    """Scaled by N / (N - terms): the mean square of the residual is the noise's, for 12 markers as for 63."""
    rng = np.random.default_rng(0)
    for count in (12, 63):
        squares = []
        for _ in range(600):
            position = rng.uniform(-1, 1, (count, 2))
            noise = rng.standard_normal((count, 2))
            squares.append(np.mean(smooth_residual(position - position.mean(axis=0), noise, "quadratic") ** 2))
        # 600 x 2 (N - 6) squares of standard normals: relative deviation sqrt(2 / 7200) = 0.017 at worst.
        assert np.mean(squares) == pytest.approx(1.0, abs=0.07)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_or_coinciding_markers_have_no_affine_motion(count):
    assert fit_affine(np.zeros((count, 2)), np.zeros((count, 2))) is None


def test_markers_in_one_line_have_a_rigid_and_no_affine_motion():
    line = np.stack([np.linspace(0, 1, 9), np.linspace(0, 2, 9)], axis=1)
    vector = 0.1 * np.stack([-line[:, 1], line[:, 0]], axis=1)
    assert fit_affine(line, vector) is None
    assert rigid(Points(as_complex(line)), as_complex(vector))[1] == pytest.approx(0.1)
    assert np.isfinite(smooth_residual(line - line.mean(axis=0), vector, "quadratic")).all()


def test_coinciding_markers_have_no_inertia_to_turn():
    assert Points(np.full(5, 0.25 + 0.25j)).inertia == 0
    assert Points(np.full(1, 0.25 + 0.25j)).inertia == 0


def test_two_markers_have_a_motion():
    assert rigid(Points(np.array([0.0 + 0j, 1.0])), np.array([-0.1j, 0.1j]))[1] == pytest.approx(0.2)


def entropy_by_counting(magnitude_m):
    """Shannon's formula on the histogram itself."""
    bins = np.minimum(np.floor(magnitude_m / 31.25e-6), 63)
    share = np.unique(bins, return_counts=True)[1] / len(magnitude_m)
    return float(-(share * np.log(share)).sum())


@given(st.lists(st.integers(0, 200), min_size=1, max_size=400))
def test_the_entropy_is_shannon_s(bins):
    magnitude = (np.array(bins) + 0.5) * 31.25e-6
    assert displacement_entropy(magnitude) == pytest.approx(entropy_by_counting(magnitude), abs=1e-9)


@pytest.mark.parametrize("count", [4096, 4800])
def test_the_densest_grid_of_sample_points_has_an_entropy(count):
    assert displacement_entropy(np.zeros(count)) == 0
    assert displacement_entropy(np.arange(count) % 2 * 1e-3) == pytest.approx(np.log(2))


def test_no_marker_has_no_entropy():
    assert np.isnan(displacement_entropy(np.empty(0)))
