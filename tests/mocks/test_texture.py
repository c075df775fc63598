import numpy as np
import pytest
from lsds_mocks.plant.friction import LEAST_KINETIC_SHARE, SurfaceFriction
from lsds_mocks.plant.texture import Chatter, Texture

POINTS = np.stack([g.ravel() for g in np.meshgrid(np.linspace(-4e-3, 4e-3, 10), np.linspace(-9e-3, 9e-3, 10))])


def friction(amplitude=0.0, chatter=0.0):
    return SurfaceFriction(
        Texture(0.15, amplitude, np.random.default_rng(1)),
        static=0.55,
        kinetic=0.45,
        stribeck_m_s=0.01,
        chatter=Chatter(0.15, np.random.default_rng(2)),
        chatter_amplitude=chatter,
    )


def test_stribeck_falls_from_static_to_kinetic():
    plain = friction()
    at_rest, sliding = np.zeros(100, bool), np.ones(100, bool)
    assert plain.at(POINTS, 0.0, at_rest, 0.05) == pytest.approx(np.full(100, 0.55))
    values = [plain.at(POINTS, 0.0, sliding, v)[0] for v in (0.0, 0.005, 0.01, 0.02, 0.1)]
    assert values[0] == pytest.approx(0.55)
    assert values[-1] == pytest.approx(0.45)
    assert (np.diff(values) < 0).all()


def test_texture_has_its_amplitude_and_travels_with_the_object():
    texture = Texture(0.15, 0.08, np.random.default_rng(3))
    out = np.empty(100)
    index = texture.index(POINTS[0], POINTS[1])
    values = np.concatenate([texture.at(index, s, out).copy() for s in np.arange(0, 0.15, 0.003)])
    assert values.mean() == pytest.approx(1.0, abs=0.01)
    assert values.std() == pytest.approx(0.08, rel=0.15)
    assert np.abs(values - 1).max() <= 0.24 + 1e-9
    moved = texture.index(POINTS[0], POINTS[1] + 2e-3)
    assert np.array_equal(texture.at(moved, 2e-3, out.copy()), texture.at(index, 0.0, out))


def test_texture_and_chatter_have_no_seam():
    texture, chatter = Texture(0.15, 0.08, np.random.default_rng(3)), Chatter(0.15, np.random.default_rng(4))
    index, out = texture.index(np.zeros(1), np.zeros(1)), np.empty(1)
    along = np.array([texture.at(index, s, out)[0] for s in np.arange(0, 0.4, 0.05e-3)])
    assert np.abs(np.diff(along)).max() < 0.06
    values = np.array([chatter.at(s) for s in np.arange(0, 0.3, 0.01e-3)])
    assert np.abs(np.diff(values)).max() < 0.15
    assert values.std() == pytest.approx(1.0, rel=0.2)


def test_chatter_touches_sliding_points_only_and_stays_in_bounds():
    rough = friction(chatter=0.6)
    at_rest, sliding = np.zeros(100, bool), np.ones(100, bool)
    assert rough.at(POINTS, 0.02, at_rest, 0.05) == pytest.approx(np.full(100, 0.55))
    values = np.array([rough.at(POINTS, s, sliding, 0.05)[0] for s in np.arange(0, 0.1, 1e-4)])
    assert values.max() <= 0.55
    assert values.min() >= LEAST_KINETIC_SHARE * 0.45 - 1e-12
    assert values.std() > 0.05
