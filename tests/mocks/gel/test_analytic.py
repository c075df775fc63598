"""Against closed forms on the half-space: Hertz, Cattaneo and Mindlin, full torsion."""

import math

import numpy as np
import pytest
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.shapes import Sphere

RADIUS, DEPTH, FRICTION = 12e-3, 0.4e-3, 0.6
A = math.sqrt(RADIUS * DEPTH)


def hertz_n(material):
    return 4 / 3 * material.modulus_pa / (1 - material.poisson**2) * math.sqrt(RADIUS) * DEPTH**1.5


def pressed(poisson, friction, fine=4, kernel="half-space"):
    gel = FieldGel(
        Sphere(RADIUS), GelMaterial(poisson=poisson), fine=fine, kernel=kernel, follows=False, tolerance=1e-3
    )
    for depth in np.linspace(DEPTH / 5, DEPTH, 5):
        gel.press(depth)
        gel.set_friction(np.full(gel.points_m.shape[1], friction))
        reaction = gel.trial(0.0, 0.0)
        gel.commit()
    return gel, reaction


@pytest.mark.parametrize("poisson", [0.30, 0.48, 0.499])
def test_hertz_force_and_pressure(poisson):
    gel, reaction = pressed(poisson, 0.0)
    assert reaction.normal_n == pytest.approx(hertz_n(gel.material), rel=3e-3)
    pressure = gel.state().pressure_n / gel.grid.cell_m2
    r = np.hypot(*gel.points_m)
    peak = 1.5 * hertz_n(gel.material) / (math.pi * A**2)
    inside = r < 0.9 * A
    assert pressure[inside] == pytest.approx(peak * np.sqrt(1 - (r[inside] / A) ** 2), abs=0.02 * peak)
    assert (pressure >= 0).all()


def test_cattaneo_mindlin_force_and_stick_radius():
    # Without coupling between pressure and shear, as the closed form assumes: an incompressible half-space.
    gel, reaction = pressed(0.4999, FRICTION)
    limit = FRICTION * reaction.normal_n
    shear, poisson = gel.material.shear_modulus_pa, gel.material.poisson
    whole = 3 * limit * (2 - poisson) / (16 * shear * A)
    gone = 0.0
    for share in np.linspace(0.05, 0.95, 10):
        reaction = gel.trial(share * whole - gone, 0.0)
        gel.commit()
        gone = share * whole
        expected = limit * (1 - (1 - share) ** 1.5)
        assert reaction.force_x_n == pytest.approx(expected, abs=5e-3 * limit)
        stuck = ~gel._slid & (gel.state().pressure_n > 0)
        radius = math.sqrt(np.count_nonzero(stuck) * gel.grid.cell_m2 / math.pi)
        assert radius == pytest.approx(A * math.sqrt(1 - share), abs=0.03 * A)


def test_full_torsion():
    gel, reaction = pressed(0.48, FRICTION)
    normal = reaction.normal_n
    for _ in range(40):
        reaction = gel.trial(0.0, 0.0, 0.05)
        gel.commit()
    assert reaction.torque_nm == pytest.approx(3 * math.pi / 16 * FRICTION * normal * A, rel=3e-3)
