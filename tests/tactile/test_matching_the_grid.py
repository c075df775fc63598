"""All dots of a frame are matched with the grid's markers, although the gel moved otherwise than predicted."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_plugins.trackers.dotted.association import associate
from tactile.following import FOLLOWERS, Bench, bump
from tactile.render import WIDTH, pad_positions

pytestmark = pytest.mark.parametrize("name", sorted(FOLLOWERS))


def column_bump(rest, sigma_px):
    """Weights (N, 1) of a displacement that is felt along a line from top to bottom, as under a cylinder."""
    return np.exp(-((rest[:, :1] - WIDTH / 2) ** 2) / (2 * sigma_px**2))


def test_a_marker_whose_neighbours_are_worn_off_is_not_all_that_is_matched(name):
    """Its dot is exactly where it is predicted, so that the matching begins there."""
    rest = pad_positions()
    row_3 = 3 * 9
    rest = np.delete(rest, [row_3 - 9, row_3 + 9, row_3 + 1], axis=0)
    pad = Bench(name, rest=rest).tracker._lattice
    shown = pad.home_px + bump(pad.home_px, 60) * np.array([0.0, 20.0])
    assert not Bench(name).tracker._lattice.bridge.any(), "on a whole pad nothing is passed on"
    assert np.count_nonzero(pad.bridge) == 4
    [alone] = np.flatnonzero((pad.neighbour[: pad.count] >= pad.count).all(axis=1))
    predicted = shown + bump(pad.home_px, 60) * np.array([0.0, 14.0]) + 0.5
    predicted[alone] = shown[alone]
    found = associate(predicted, shown, pad, pad.home_px)
    assert not found.ambiguous
    assert (found.dot == np.arange(pad.count)).all()


def test_an_object_that_bounces_under_a_moving_finger_is_followed(name):
    """The shear swings by half a pitch from frame to frame: extrapolated motion is wrong by a whole one."""
    bench = Bench(name)
    weight = column_bump(bench.rest, 32)
    path = (0, 6, 14, 22, 8, 24, 7, 20, 6, 20)
    steps = [bench.move(weight * np.array([0.0, y])) for y in path]
    assert sum(step.wrong_unflagged for step in steps) == 0
    assert min(step.kept for step in steps) >= 50
