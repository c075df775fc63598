"""Turned and mirrored examples: what has no direction stays, vectors turn together, what turns changes sign."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_research.learners.symmetry import DIRECTED, ODD, VECTORS, Symmetry

from lsds.models.signals import SIGNAL_SETS, SIGNALS

NAMES = SIGNAL_SETS["timed-field"]
AT = {name: index for index, name in enumerate(NAMES)}


def examples(seed, count=20, length=3):
    rng = np.random.default_rng(seed)
    return rng.standard_normal((count, length, len(NAMES))).astype(np.float32), rng.standard_normal((count, 3)).astype(
        np.float32
    )


@given(st.integers(0, 2**31))
def test_turning_keeps_what_has_no_direction_and_all_angles_between_vectors(seed):
    x, y = examples(seed)
    new, labels = Symmetry(NAMES).turned(x, y, np.random.default_rng(seed))
    directed = {name for pair in VECTORS for name in pair} | set(ODD)
    for name in set(NAMES) - directed:
        assert np.array_equal(new[:, :, AT[name]], x[:, :, AT[name]])
    assert np.hypot(labels[:, 0], labels[:, 1]) == pytest.approx(np.hypot(y[:, 0], y[:, 1]), rel=1e-4)

    def along_shear(windows, velocity):
        shear = windows[:, -1, [AT["shear_x"], AT["shear_y"]]]
        return (shear * velocity[:, :2]).sum(axis=1), shear[:, 0] * velocity[:, 1] - shear[:, 1] * velocity[:, 0]

    (before, turn), (after, turned) = along_shear(x, y), along_shear(new, labels)
    assert after == pytest.approx(before, abs=1e-4)
    # A mirror turns the sense of rotation round, of the label and of every signal that has one.
    mirror = np.sign(labels[:, 2] / y[:, 2])
    assert turned == pytest.approx(mirror * turn, abs=1e-4)
    for name in set(ODD) & set(NAMES):
        assert new[:, :, AT[name]] == pytest.approx(mirror[:, None] * x[:, :, AT[name]])


def test_a_share_is_left_as_it_is_and_nothing_given_is_changed():
    x, y = examples(1, 1000)
    kept = x.copy(), y.copy()
    new, labels = Symmetry(NAMES).turned(x, y, np.random.default_rng(0), 0.5)
    assert 0.4 < np.mean((new == x).all(axis=(1, 2)) & (labels == y).all(axis=1)) < 0.6
    assert np.array_equal(x, kept[0])
    assert np.array_equal(y, kept[1])


def test_sets_without_direction_or_with_half_of_one_are_left_alone():
    assert Symmetry(NAMES).known
    assert not Symmetry(SIGNAL_SETS["combined"]).known
    assert not Symmetry(("shear_x", "v_x", "v_y")).known
    assert not Symmetry((*NAMES, DIRECTED[0])).known


def test_every_signal_it_knows_exists():
    assert {*ODD, *DIRECTED, *(name for pair in VECTORS for name in pair)} <= set(SIGNALS)
