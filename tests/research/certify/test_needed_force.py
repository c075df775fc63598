"""The columns of load: those of the mocks' own laws, and worth more to a forest than the keys alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lsds_research.certify.needed_force import NeededForce
from lsds_research.certify.sequential import sequential
from lsds_research.search.objects import OBJECTS, completed
from lsds_research.search.space import Axis, point_to_scenario
from research.certify.answering import answered, budget

pytest.importorskip("sklearn", reason="scikit-learn is not installed: pip install '.[search]'")


def test_the_columns_are_the_needed_force_and_its_share_of_what_the_gel_carries():
    mass = Axis("cell.simulated.mass_kg", 0.1, 0.3)
    columns = NeededForce([mass], dict)([np.array([0.0]), np.array([1.0])])
    assert columns[:, 0].tolist() == [0.0, 1.0]
    # The pipe: 0.3 kg at a friction of 0.55 between two fingers.
    assert math.exp(columns[1, 1]) == pytest.approx(0.3 * 9.81 / 2 / 0.55)
    assert columns[1, 1:] - columns[0, 1:] == pytest.approx(math.log(3.0))
    twice = NeededForce([mass], dict, ["cell.simulated.friction_scale=0.5", "seed=3"])([np.array([1.0])])
    assert twice[0, 1:] - columns[1, 1:] == pytest.approx(math.log(2.0))


def test_an_object_that_cannot_be_built_has_no_load():
    mass = Axis("cell.simulated.mass_kg", -2.0, -1.0)
    assert NeededForce([mass], dict)([np.array([0.5])]).tolist() == [[0.5, 0.0, 0.0]]


def test_a_forest_with_them_ranks_lifts_that_are_too_heavy_for_their_friction_better():
    loads = NeededForce(OBJECTS, completed)

    def margin(point):
        keys = completed(point_to_scenario(OBJECTS, point))
        return 1.5 - keys["cell.simulated.mass_kg"] / keys["cell.simulated.static_friction"]

    without, with_them = (
        np.mean([answered(sequential(len(OBJECTS), budget(96), seed, **given), margin)[0].auc for seed in (4, 5, 6)])
        for given in ({}, {"describe": loads})
    )
    assert with_them > 0.9
    assert with_them > without + 0.03
