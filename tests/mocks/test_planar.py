"""An object that rotates in the grip: at rest, released, and compared with the case of one unknown."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.gel.placement import Placement
from lsds_mocks.gel.shapes import Cylinder, Sphere
from lsds_mocks.gel.winkler import WinklerGel
from lsds_mocks.plant.lift import GRAVITY_M_S2, ObjectMotion, step_object
from lsds_mocks.plant.planar import Body, PlanarMotion, step_planar

MASS = 0.1
INERTIA = 1e-4


def hang(gel, *, centre=(0.0, 0.0), depth=0.5e-3, friction=1.0, dt_s=2e-3, steps=300, theta=1.0, carrier=0.0):
    """Hold an object high above the table; yield motion and reaction of each step."""
    motion, body = PlanarMotion(0.5, 0.0, supported=False), Body(MASS, INERTIA, centre)
    for at in np.linspace(depth / 5, depth, 5):
        normal = gel.press(at)
        gel.set_friction(np.full(gel.points_m.shape[1], friction))
        gel.trial(0.0, 0.0)
        gel.commit()
    for _ in range(steps):
        reaction = step_planar(
            motion,
            gel,
            body,
            carrier_velocity_m_s=carrier,
            dt_s=dt_s,
            fingers=2,
            limit_n=friction * normal,
            theta=theta,
        )
        yield motion, reaction


def gels():
    return [WinklerGel(Sphere(12e-3)), FieldGel(Sphere(12e-3), fine=1)]


@pytest.mark.parametrize("gel", gels(), ids=["winkler", "pad"])
@pytest.mark.parametrize("centre", [(2e-3, 0.0), (0.0, 20e-3), (-3e-3, 10e-3)])
def test_at_rest_forces_and_moments_balance(gel, centre):
    *_, (motion, reaction) = hang(
        gel, centre=centre, depth=0.8e-3, friction=1.5, dt_s=20e-3
    )  # long steps damp the swing
    assert 2 * reaction.force_y_n == pytest.approx(MASS * GRAVITY_M_S2, rel=0.02)
    assert 2 * reaction.force_x_n == pytest.approx(0.0, abs=0.02)
    x, _ = Body(MASS, INERTIA, centre).centre_at(motion.place)
    # The moment of the grip about the pads' centre carries the weight at its arm.
    assert 2 * reaction.torque_nm == pytest.approx(MASS * GRAVITY_M_S2 * x, abs=0.03 * MASS * GRAVITY_M_S2 * 3e-3)
    assert abs(motion.velocity_m_s) < 1e-3
    assert abs(motion.rate_rad_s) < 0.05


@pytest.mark.parametrize("gel", gels(), ids=["winkler", "pad"])
def test_a_centre_of_mass_to_the_right_turns_it_clockwise(gel):
    *_, (motion, _) = hang(gel, centre=(15e-3, 0.0), depth=0.8e-3, friction=0.8, steps=60)
    assert motion.place.angle_rad > 0.02
    assert Body(MASS, INERTIA, (15e-3, 0.0)).centre_at(motion.place)[1] > motion.place.y_m


def test_with_the_centre_between_the_pads_it_is_the_vertical_case():
    planar = list(hang(WinklerGel(Sphere(12e-3)), friction=0.5, depth=0.3e-3, steps=100))
    gel, body = WinklerGel(Sphere(12e-3)), ObjectMotion(0.5, 0.0, supported=False)
    normal = gel.press(0.3e-3)
    gel.set_friction(np.full(gel.points_m.shape[1], 0.5))
    for _ in range(100):
        step_object(body, gel, carrier_velocity_m_s=0.0, mass_kg=MASS, dt_s=2e-3, limit_n=0.5 * normal * 1.01)
    motion, _ = planar[-1]
    assert motion.height_m == pytest.approx(body.height_m, abs=1e-5)
    assert motion.velocity_m_s == pytest.approx(body.velocity_m_s, abs=1e-4)
    assert motion.place.angle_rad == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("gel", gels(), ids=["winkler", "pad"])
def test_released_it_falls_freely_without_rotation(gel):
    *_, (motion, _) = hang(gel, centre=(5e-3, 3e-3), depth=1e-9, steps=100)
    assert motion.velocity_m_s == pytest.approx(-GRAVITY_M_S2 * 0.2, rel=1e-3)
    assert motion.rate_rad_s == pytest.approx(0.0, abs=1e-3)


@settings(max_examples=25)
@given(
    dt_s=st.floats(0.5e-3, 40e-3),
    friction=st.floats(0.3, 2.5),
    centre=st.tuples(st.floats(-15e-3, 15e-3), st.floats(-30e-3, 30e-3)),
    depth=st.floats(0.1e-3, 0.8e-3),
)
def test_energy_is_never_created(dt_s, friction, centre, depth):
    gel, body = WinklerGel(Sphere(12e-3)), Body(MASS, INERTIA, centre)
    before = None
    for motion, _ in hang(
        gel, centre=centre, depth=depth, friction=friction, dt_s=dt_s, steps=max(10, int(0.2 / dt_s))
    ):
        moving = MASS * (motion.velocity_m_s**2 + motion.velocity_x_m_s**2) + INERTIA * motion.rate_rad_s**2
        now = 0.5 * moving + MASS * GRAVITY_M_S2 * motion.height_m + 2 * gel.elastic_energy_j
        assert math.isfinite(now)
        # The frame of reference turns with the object only at the end of a step: second order in the step's turn.
        slack = 1e-9 + MASS * GRAVITY_M_S2 * 30e-3 * (dt_s * motion.rate_rad_s) ** 2
        assert before is None or now <= before + slack
        before = now
    assert body.mass_kg == MASS


@pytest.mark.parametrize("theta", [1.0, 0.5])
def test_the_step_does_not_matter(theta):
    ends = []
    for dt_s in (0.5e-3, 2e-3):
        gel = FieldGel(Cylinder(12.5e-3, 20.16e-3), fine=1)
        *_, (motion, _) = hang(gel, centre=(10e-3, 0.0), friction=0.6, dt_s=dt_s, steps=round(0.3 / dt_s), theta=theta)
        ends.append(motion)
    assert ends[1].place.angle_rad == pytest.approx(ends[0].place.angle_rad, rel=0.05, abs=0.01)
    assert ends[1].height_m == pytest.approx(ends[0].height_m, abs=1e-3)


def test_placements_add_up_like_rigid_motions():
    place = Placement().moved(1e-3, 0.0, 0.0).moved(0.0, 0.0, math.pi / 2)
    assert (place.x_m, place.y_m, place.angle_rad) == pytest.approx((0.0, 1e-3, math.pi / 2), abs=1e-12)
