"""The markers of a released gel are identified, even if they were confused while an object pressed on it."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_plugins.trackers.dotted.association import LACKING_DOTS, associate
from tactile.following import Bench


def lattice():
    return Bench("lk").tracker._lattice


def astray(home, count, pitch, seed):
    """Return positions (N, 2) of markers, `count` neighbours of which are wrong by a pitch."""
    rng = np.random.default_rng(seed)
    middle = home[rng.integers(len(home))]
    led = np.argsort(((home - middle) ** 2).sum(axis=1))[:count]
    xy = home.copy()
    xy[led] += pitch * np.array([[0, 1], [0, -1], [1, 0], [-1, 0]])[rng.integers(4)]
    return xy


@pytest.mark.parametrize("count", [2, 5, 12, 20])
def test_markers_that_were_led_astray_come_home(count):
    pad = lattice()
    home = pad.home_px
    for seed in range(10):
        predicted = astray(home, count, pad.pitch_px, seed)
        dots = np.random.default_rng(seed).permutation(home)
        found = associate(predicted, dots, pad, predicted)
        assert not found.ambiguous
        assert np.array_equal(dots[found.dot], home)
        assert np.array_equal(found.expected_px, home)


def test_a_few_worn_dots_are_lost_and_do_not_affect_the_others():
    pad = lattice()
    predicted = astray(pad.home_px, 5, pad.pitch_px, 0)
    found = associate(predicted, pad.home_px[LACKING_DOTS:], pad, predicted)
    assert not found.ambiguous
    assert (found.dot[:LACKING_DOTS] == -1).all()
    assert np.array_equal(found.dot[LACKING_DOTS:], np.arange(pad.count - LACKING_DOTS))


def test_dots_in_their_places_are_no_rest_after_a_leap_by_a_pitch():
    """All but one line of markers seem at rest."""
    pad = lattice()
    home = pad.home_px
    leapt = home + np.array([0.0, pad.pitch_px])
    shown = leapt[pad.in_view(leapt, 0.0)]
    assert np.abs(np.median(associate(home, shown, pad, home).expected_px - home, axis=0)).max() > 0.5 * pad.pitch_px
