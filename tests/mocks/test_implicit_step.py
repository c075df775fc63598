"""The implicit friction step: finite, inside the Coulomb limit and free of created energy at any step."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.gel.shapes import Cylinder
from lsds_mocks.gel.winkler import WinklerGel
from lsds_mocks.plant.lift import GRAVITY_M_S2, ObjectMotion, step_object

MASS, MU = 0.3, 0.5


def depth_at(force_n):
    """Indentation of the default pipe under a normal force: N goes with its 3/2 power."""
    return 0.3e-3 * (force_n / 2.52) ** (2 / 3)


def drop(dt_s, force_of, steps, velocity=0.0, height=0.5):
    """Let go of an object high above the table with a given grip force over time; yield body, gel, force, limit."""
    gel = WinklerGel(Cylinder(12.5e-3, 20.16e-3))
    body = ObjectMotion(height, velocity, supported=False)
    for k in range(steps):
        normal = force_of(k * dt_s)
        normal = gel.press(depth_at(normal))
        gel.set_friction(np.full(gel.points_m.shape[1], MU))
        limit = MU * normal * 1.01
        reaction = step_object(body, gel, carrier_velocity_m_s=0.0, mass_kg=MASS, dt_s=dt_s, limit_n=limit)
        yield body, gel, reaction.force_y_n, MU * normal


def energy(body, gel):
    return 0.5 * MASS * body.velocity_m_s**2 + MASS * GRAVITY_M_S2 * body.height_m + 2 * gel.elastic_energy_j


@given(
    dt_s=st.floats(0.5e-3, 40e-3),
    normal=st.lists(st.floats(0.0, 12.0), min_size=1, max_size=8),
    velocity=st.floats(-0.5, 0.5),
)
def test_energy_is_never_created_and_everything_stays_finite(dt_s, normal, velocity):
    before = 0.5 * MASS * velocity**2 + MASS * GRAVITY_M_S2 * 0.5
    phase = 0.05
    for body, gel, force, limit in drop(
        dt_s, lambda t: normal[int(t / phase) % len(normal)], max(8, round(0.4 / dt_s)), velocity
    ):
        now = energy(body, gel)
        assert math.isfinite(now)
        assert now <= before + 1e-12
        assert abs(force) <= limit * (1 + 1e-9) + 1e-300  # below, numbers are subnormal and products lose digits
        before = now


@given(dt_s=st.floats(0.5e-3, 40e-3))
def test_a_grip_that_holds_at_one_step_holds_at_all(dt_s):
    *_, (body, _, force, _) = drop(dt_s, lambda _: 6.0, round(1.0 / dt_s))
    assert body.height_m == pytest.approx(0.5 - MASS * GRAVITY_M_S2 / 2 / 3.57e3, abs=1e-4)
    assert force * 2 == pytest.approx(MASS * GRAVITY_M_S2, rel=0.02)
    assert abs(body.velocity_m_s) < 2e-3


@pytest.mark.parametrize(("dt_ms", "tolerance"), [(0.5, 0.005), (2, 0.01), (8, 0.04), (40, 0.2)])
def test_sliding_under_too_weak_a_grip_converges_to_the_exact_fall(dt_ms, tolerance):
    dt_s, time = dt_ms * 1e-3, 0.2
    normal = WinklerGel(Cylinder(12.5e-3, 20.16e-3)).press(depth_at(1.5))
    *_, (body, _, force, _) = drop(dt_s, lambda _: 1.5, round(time / dt_s), velocity=-0.3)
    acceleration = GRAVITY_M_S2 - 2 * MU * normal / MASS
    exact = 0.3 * time + 0.5 * acceleration * time**2
    assert 0.5 - body.height_m == pytest.approx(exact, rel=tolerance)
    assert force == pytest.approx(MU * normal)


def test_grip_lost_and_regained_stops_the_fall():
    def force_of(t):
        return 0.8 if 0.6 <= t < 0.75 else 6.0

    heights = {}
    for dt_ms in (0.5, 2, 8):
        *_, (body, _, _, _) = drop(dt_ms * 1e-3, force_of, round(1.2e3 / dt_ms))
        heights[dt_ms] = body.height_m
        assert abs(body.velocity_m_s) < 0.01
    fallen = 0.5 - heights[0.5]
    assert 0.05 < fallen < 0.3
    assert 0.5 - heights[2] == pytest.approx(fallen, rel=0.02)
    assert 0.5 - heights[8] == pytest.approx(fallen, rel=0.06)


def test_the_table_stops_the_object_without_a_rebound():
    *_, (body, _, _, _) = drop(2e-3, lambda _: 0.0, 400, height=0.1)
    assert body.supported
    assert body.height_m == 0.0
    assert body.velocity_m_s == 0.0
