"""The first guess of a contact's solution: exact where tractions are linear in the motion, and never a worse answer."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.gel.field.extrapolation import MOST_WAYS, Extrapolation
from lsds_mocks.gel.field.gel import TRACTION_TOLERANCE, FieldGel
from lsds_mocks.gel.shapes import Box, Flat

# Whole femtometres: the square of a motion of 1e-160 m has no digits left.
ways = st.tuples(*[st.integers(-(10**10), 10**10).map(lambda femtometres: 1e-15 * femtometres)] * 4)


def arrays(value):
    return np.full((3, 5), value, np.float32), np.full((3, 5), 2 * value, np.float32)


def guessed(near, at):
    traction, w = arrays(-1.0)
    near.guess(at, traction, w)
    return traction, w


@given(ways, st.floats(-MOST_WAYS, MOST_WAYS))
def test_a_linear_solution_is_guessed_exactly(way, share):
    size = float(np.dot(way, way))
    near = Extrapolation()
    near.learn((0.0,) * 4, *arrays(1.0))
    near.learn(way, *arrays(3.0))
    traction, w = guessed(near, tuple((1 + share) * part for part in way))
    if size == 0.0:
        assert (traction == -1.0).all()
        return
    assert traction == pytest.approx(np.full((3, 5), 3.0 + 2.0 * share), rel=1e-5, abs=1e-5)
    assert w == pytest.approx(2 * traction, rel=1e-6)


def test_nothing_is_guessed_from_one_solution_or_after_a_change():
    near = Extrapolation()
    near.learn((0.0,) * 4, *arrays(1.0))
    assert (guessed(near, (1e-6, 0.0, 0.0, 0.0))[0] == -1.0).all()
    near.learn((1e-6, 0.0, 0.0, 0.0), *arrays(2.0))
    near.clear()
    assert (guessed(near, (2e-6, 0.0, 0.0, 0.0))[0] == -1.0).all()


def test_a_solution_close_to_the_newer_one_replaces_that_only():
    """Two solutions that lie close together have an uncertain slope: the older one stays."""
    near = Extrapolation()
    for at, value in ((0.0, 0.0), (1e-6, 1.0), (1.1e-6, 1.1)):
        near.learn((at, 0.0, 0.0, 0.0), *arrays(value))
    assert guessed(near, (2.2e-6, 0.0, 0.0, 0.0))[0] == pytest.approx(2.2, rel=1e-5)
    # One that lies apart replaces both.
    near.learn((2.2e-6, 0.0, 0.0, 0.0), *arrays(5.0))
    assert guessed(near, (3.3e-6, 0.0, 0.0, 0.0))[0] == pytest.approx(5.0 + 3.9, rel=1e-5)


def test_what_is_learnt_is_kept_when_the_arrays_change():
    near = Extrapolation()
    traction, w = arrays(1.0)
    near.learn((0.0,) * 4, traction, w)
    traction[:] = w[:] = 7.0
    near.learn((1e-6, 0.0, 0.0, 0.0), *arrays(2.0))
    assert (guessed(near, (2e-6, 0.0, 0.0, 0.0))[0] == 3.0).all()


def shaken(shape, tolerance=TRACTION_TOLERANCE):
    """Return the shear forces of a gel that is sheared and shaken by 0.4 um, and how many steps took iterations."""
    gel = FieldGel(shape, fine=1, solver="fft", tolerance=tolerance)
    gel.press(0.05e-3)
    gel.set_friction(np.full(gel.points_m.shape[1], 0.6))
    gel.trial(0.0, 8e-6)
    gel.commit()
    forces, iterations, before = [], 0, gel.effort.sweeps
    for k in range(100):
        forces.append(gel.trial(0.0, 0.4e-6 * np.sin(k) + 0.1e-6).force_y_n)
        gel.commit()
        iterations += gel.effort.sweeps - before > 1
        before = gel.effort.sweeps
    return np.array(forces), iterations


@pytest.mark.parametrize("shape", [Flat(), Box(12e-3, 0.1, 1e-3)])
def test_a_vibration_takes_fewer_iterations_and_its_force_is_as_exact(shape, monkeypatch):
    forces, iterations = shaken(shape)
    monkeypatch.setattr(Extrapolation, "guess", lambda *_: None)
    without, more = shaken(shape)
    exact, _ = shaken(shape, tolerance=1e-4)
    assert iterations < 0.2 * more
    errors = [np.sqrt(np.mean((each - exact) ** 2)) / np.abs(exact).max() for each in (forces, without)]
    assert errors[0] < max(1.2 * errors[1], 0.005)


def test_sweeps_start_from_the_last_solution_also_after_descent(monkeypatch):
    """Sweeps leave scattered errors, which a guess would multiply; what descent has learnt would soon be old."""
    gel = FieldGel(Box(8e-3, 8e-3, 1e-3), fine=1)
    gel.press(0.2e-3)
    assert gel._patch.solver == "blocks"
    for k in range(2):
        gel._near.learn((1e-6 * k, 0.0, 0.0, 0.0), gel._traction, gel._w)
    monkeypatch.setattr(Extrapolation, "guess", lambda *_: pytest.fail("a guess for sweeps"))
    gel.trial(0.0, 1e-6)
    gel.trial(0.0, 2e-6)
