"""The rules of slip and drop that the plants share."""

import numpy as np
import pytest
from lsds_mocks.plant.slip import STILL_STICKS, drops, radius_of_gyration_m, sliding_speed_m_s, slips


class Sticks:
    """A gel with a given share of sticking cells."""

    def __init__(self, stick_ratio):
        self.stick_ratio = stick_ratio


def test_a_contact_slips_when_nearly_nothing_sticks():
    assert slips(Sticks(STILL_STICKS), 1.0)
    assert not slips(Sticks(STILL_STICKS + 0.01), 1.0)
    assert not slips(Sticks(0.0), 0.0)


def test_rotation_counts_at_the_radius_of_gyration():
    points = np.array([[-3.0, 3.0], [-4.0, 4.0]])
    assert radius_of_gyration_m(points) == pytest.approx(5.0)
    assert radius_of_gyration_m(np.zeros((2, 0))) == 0.0
    assert sliding_speed_m_s(0.0, 12.0, 1.0, 5.0) == pytest.approx(13.0)


def test_an_object_drops_without_support_or_after_a_long_slip():
    assert drops(0.0, False, 0.0, 0.06)
    assert drops(1.0, False, 0.07, 0.06)
    assert not drops(0.0, True, 0.0, 0.06)
    assert not drops(1.0, False, 0.06, 0.06)
