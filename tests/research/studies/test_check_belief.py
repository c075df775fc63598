"""Checks of the belief and of the normal force against the truth, on random objects."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lsds_research.studies.grip import fit_power
from lsds_research.studies.grip.check_belief import Checked, checked, lines
from lsds_research.studies.grip.fit_normal import Pressed, pressed


def test_the_force_of_a_cylinder_is_right_within_a_fifth_at_every_squeeze():
    found = pressed((1003, 10))
    assert found.shape == "cylinder"
    assert abs(found.error) < 0.2
    assert abs(found.growth_error) < 0.2


def test_the_growth_is_that_between_the_least_and_the_greatest_force():
    found = Pressed("sphere", np.array([1.0, 2.2, 4.8]), np.array([1.0, 2.0, 4.0]))
    assert found.error == pytest.approx(math.log(1.1))
    assert found.growth_error == pytest.approx(math.log(1.2))
    assert math.isnan(Pressed("box", np.array([1.0, 1.3]), np.array([1.0, 1.2])).growth_error)


def test_the_belief_s_error_is_one_of_its_standard_deviations():
    found = checked((1003, 10))
    assert found is not None
    assert abs(found.error) < 3 * found.stated
    assert abs(found.load_change) < 0.3


def test_an_object_that_does_not_slip_does_not_count():
    assert checked((1001, 0)) is None


def test_each_shape_has_a_line():
    rows = [Checked("sphere", 0.1, 0.2, 0.0, math.nan), Checked("box", -0.5, 0.2, 0.1, 0.3)]
    every, box, sphere = lines(rows)
    assert every.startswith("all: 2 lifts, error -0.20, scatter 0.44 (2)")
    assert "within one 0%" in box
    assert "within one 100%" in sphere
    assert sphere.endswith("normal force unknown")


@pytest.mark.parametrize(
    ("index", "shape", "kind", "low", "high"),
    [
        (2, "cylinder", fit_power.LONG, 1.0, 1.2),
        (31, "sphere", fit_power.ROUND, 1.2, 1.5),
        (12, "box", "flat", 0.9, 1.1),
    ],
)
def test_the_normal_force_of_a_round_contact_grows_with_a_greater_power(index, shape, kind, low, high):
    found = fit_power.grown((1001, index))
    assert found is not None
    assert (found.shape, found.kind) == (shape, kind)
    assert low < found.power < high


def test_powers_are_printed_by_contact_and_by_shape():
    rows = [fit_power.Grown("sphere", "round", 1.4), fit_power.Grown("box", "flat", 1.0)]
    flat, found_round, *_ = fit_power.lines(rows)
    assert flat.startswith("contact flat: 1 objects, power +1.00")
    assert found_round.startswith("contact round: 1 objects, power +1.40")
