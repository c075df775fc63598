"""The elastic gel in the dynamics: finite, within the Coulomb limit, no gain of energy, for any time step."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from lsds_mocks.gel.auto.gel import AutoGel
from lsds_mocks.gel.field.gel import TRACTION_TOLERANCE, FieldGel
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.shapes import Box, Cylinder, Sphere
from lsds_mocks.plant.lift import GRAVITY_M_S2, ObjectMotion, step_object

MASS = 0.2
SHAPES = {"sphere": Sphere(12e-3), "pipe": Cylinder(12.5e-3, 2.0), "block": Box(8e-3, 8e-3, 0.5e-3)}


def swing(gel, *, depth, friction, dt_s, steps, velocity=0.0, theta=1.0):
    """Press in, let the object go with a velocity between two such gels; yield body, reaction and whole energy."""
    for at in np.linspace(depth / 4, depth, 4):
        normal = gel.press(at)
        gel.set_friction(np.full(gel.points_m.shape[1], friction))
        gel.trial(0.0, 0.0)
        gel.commit()
    body = ObjectMotion(0.5, velocity, supported=False)
    for _ in range(steps):
        gel.set_friction(np.full(gel.points_m.shape[1], friction))
        reaction = step_object(
            body, gel, carrier_velocity_m_s=0.0, mass_kg=MASS, dt_s=dt_s, limit_n=1.1 * friction * normal, theta=theta
        )
        moving = 0.5 * MASS * body.velocity_m_s**2 + MASS * GRAVITY_M_S2 * body.height_m
        yield body, reaction, moving + 2 * gel.elastic_energy_j


@settings(max_examples=40)
@given(
    shape=st.sampled_from(sorted(SHAPES)),
    dt_s=st.floats(math.log(0.5e-3), math.log(40e-3)).map(math.exp),
    friction=st.floats(0.3, 2.5),
    poisson=st.sampled_from([0.3, 0.45, 0.48, 0.499]),
    velocity=st.floats(-0.3, 0.3),
    depth=st.floats(0.05e-3, 0.4e-3),
)
@example(shape="pipe", dt_s=math.exp(-7), friction=2.0, poisson=0.45, velocity=0.0, depth=5e-5)
def test_no_energy_is_created_and_friction_keeps_to_coulomb(shape, dt_s, friction, poisson, velocity, depth):
    # A pipe slides along itself. The others' surfaces stay in place, as a belt's would: one that goes off the pad by
    # millimetres a step takes and gives work in between that no rule of one step can know.
    gel = FieldGel(SHAPES[shape], GelMaterial(poisson=poisson), fine=1, follows=shape == "pipe")
    before, most = None, 0.0
    for body, _, energy in swing(
        gel, depth=depth, friction=friction, dt_s=dt_s, steps=min(max(10, round(0.15 / dt_s)), 60), velocity=velocity
    ):
        assert math.isfinite(energy + body.velocity_m_s)
        tractions = gel._traction
        assert (np.hypot(*tractions[:2]) <= friction * tractions[2] * (1 + 1e-4) + 0.1).all()
        assert (tractions[2] >= 0).all()
        most = max(most, 2 * gel.elastic_energy_j)
        # Up to what the sweeps leave of the stored energy.
        assert before is None or energy <= before + TRACTION_TOLERANCE * most + 1e-9
        before = energy
    assert gel.effort.unconverged == 0


@pytest.mark.parametrize(("theta", "settled"), [(1.0, TRACTION_TOLERANCE), (0.5, 0.004)])
def test_ringing_dies_away_by_either_rule(theta, settled):
    """As the cell sets them: the midpoint rule wants its gel solved for further, or the rest feeds the ringing."""
    gel = FieldGel(SHAPES["pipe"], fine=1, tolerance=settled)
    speeds = [
        abs(body.velocity_m_s)
        for body, _, _ in swing(gel, depth=0.3e-3, friction=2.5, dt_s=0.5e-3, steps=1600, velocity=0.03, theta=theta)
    ]
    quarters = [max(speeds[k : k + 400]) for k in range(0, 1600, 400)]
    assert quarters[-1] <= quarters[1] <= quarters[0] * 1.02


@pytest.mark.parametrize(
    ("make", "steps_s"),
    [
        (lambda: FieldGel(SHAPES["pipe"], fine=1), (0.5e-3, 2e-3, 8e-3, 40e-3)),
        (lambda: AutoGel(SHAPES["pipe"], tolerance_m=20e-6), (2e-3, 8e-3, 40e-3)),
    ],
    ids=["pad", "auto"],
)
def test_what_holds_at_one_step_holds_at_all(make, steps_s):
    rest = []
    for dt_s in steps_s:
        *_, (body, reaction, _) = swing(make(), depth=0.4e-3, friction=0.8, dt_s=dt_s, steps=round(0.6 / dt_s))
        assert 2 * reaction.force_y_n == pytest.approx(MASS * GRAVITY_M_S2, rel=0.03)
        rest.append(body.height_m)
    assert np.ptp(rest) < 0.05e-3


@pytest.mark.parametrize("dt_ms", [0.5, 2, 8, 40])
def test_a_weak_grip_slides_as_a_block_on_friction_does(dt_ms):
    friction = 0.4
    gel = FieldGel(SHAPES["pipe"], fine=1)
    speeds = [
        (-body.velocity_m_s, GRAVITY_M_S2 - 2 * friction * reaction.normal_n / MASS)
        for body, reaction, _ in swing(
            gel, depth=0.25e-3, friction=friction, dt_s=dt_ms * 1e-3, steps=round(240 / dt_ms)
        )
    ]
    half = len(speeds) // 2  # by then the gel has taken up its shear
    (early, _), (late, pull) = speeds[half - 1], speeds[-1]
    assert 2 < pull < 0.9 * GRAVITY_M_S2
    assert (late - early) / ((len(speeds) - half) * dt_ms * 1e-3) == pytest.approx(pull, rel=0.01)
