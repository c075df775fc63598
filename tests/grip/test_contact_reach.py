"""The reach of a contact along the load, and what it means for the accepted slip."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_plugins.controllers.belief import BeliefController, BeliefOptions

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext, ContactPatch, GripEstimate
from lsds.tactile.contact_size import half_length_of, reach_of

PITCH_M = 2.5e-4


def patch(inside) -> ContactPatch:
    y, x = np.mgrid[:60, :80]
    depth = np.where(inside(PITCH_M * (x - 40), PITCH_M * (y - 30)), 2e-4, 0.0).astype(np.float32)
    return ContactPatch(depth, 5e-5, float((depth > 5e-5).mean()), PITCH_M)


@given(radius_mm=st.floats(1.5, 6), angle=st.floats(0, 6.3))
def test_the_reach_of_a_disc_is_its_radius_in_every_direction(radius_mm, angle):
    disc = patch(lambda x, y: np.hypot(x, y) < 1e-3 * radius_mm)
    assert reach_of(disc, (math.cos(angle), math.sin(angle))) == pytest.approx(1e-3 * radius_mm, abs=PITCH_M / 2)


def test_a_strip_reaches_farther_along_than_across():
    strip = patch(lambda x, y: np.abs(x) < 1.5e-3)
    assert reach_of(strip, (0.0, 2.0)) > 4 * reach_of(strip, (0.5, 0.0))


@given(radius_mm=st.floats(1.5, 6), angle=st.floats(0, 3.1))
def test_the_longest_direction_is_found_whatever_the_contact_s_direction(radius_mm, angle):
    radius_m = 1e-3 * radius_mm
    disc = patch(lambda x, y: np.hypot(x, y) < radius_m)
    assert half_length_of(disc) == pytest.approx(radius_m, abs=PITCH_M)
    strip = patch(lambda x, y: np.abs(x * math.cos(angle) + y * math.sin(angle)) < 1e-3)
    assert half_length_of(strip) == pytest.approx(reach_of(strip, (-math.sin(angle), math.cos(angle))), rel=0.05)
    assert half_length_of(strip) > 7e-3


def test_nothing_is_known_without_contact_direction_or_size():
    disc = patch(lambda x, y: np.hypot(x, y) < 3e-3)
    assert math.isnan(reach_of(None, (0.0, 1.0)))
    assert math.isnan(half_length_of(None))
    assert math.isnan(half_length_of(patch(lambda x, y: np.zeros_like(x, bool))))
    assert math.isnan(reach_of(disc, (0.0, 0.0)))
    assert math.isnan(reach_of(patch(lambda x, y: x > 1), (0.0, 1.0)))
    assert math.isnan(reach_of(ContactPatch(disc.depth_m, 5e-5, 0.1), (0.0, 1.0)))


def test_a_small_contact_allows_less_slip_and_an_unknown_one_the_option():
    controller = BeliefController(BeliefOptions(), BuildContext(VirtualClock()))
    accepted = [controller._slip_m(GripEstimate(reach_m=reach)) for reach in (math.nan, 0.02, 3e-3, 1e-5)]
    assert accepted[0] == accepted[1] == BeliefOptions().slip_m
    assert accepted[1] > accepted[2] > accepted[3] > 0
