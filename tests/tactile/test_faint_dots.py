"""Dots with little ink are found where the grid has them, and carried along with the gel."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_plugins.trackers.dotted.follow import DotFollower
from lsds_plugins.trackers.dotted.localise import LucasKanade
from tactile.cell_frames import CellBench

from lsds.tactile.imprint.faint import FaintDots
from lsds.tactile.options import TactileOptions
from lsds.tactile.perception import Perception

WITHIN_PX = 1.5


def watched(**sensor):
    """The bench, a perception that knows the untouched gel, its faint dots, and where the gel truly has dots."""
    bench = CellBench(1, **sensor)
    frames = bench.frames(3, 400)
    perception = Perception(DotFollower(LucasKanade()), bench.sensor.spec, TactileOptions())
    reference = perception.start(frames)
    return bench, perception, FaintDots(reference, perception.reference_frame, perception.metres_per_px)


def true_px(bench):
    return bench.sensor._renderer.markers(bench.cell.plant.gel, bench.cell.gel_state())


def nearest_px(places, true):
    return np.array([np.hypot(*(true - place).T).min() for place in places])


@pytest.mark.parametrize("gel", [1, 7, 154])
def test_dots_that_the_tracker_does_not_find_are_found_where_the_grid_has_them(gel):
    bench, perception, faint = watched(gel=gel, wear=1.0)
    unknown = [p for p in true_px(bench) if np.hypot(*(perception.reference.xy_px - p).T).min() > 4]
    assert len(unknown) > 5
    assert nearest_px(unknown, faint.xy_px).max() < WITHIN_PX


def test_what_is_taken_for_a_faint_dot_is_a_dot():
    bench, _, faint = watched(gel=1, wear=1.0)
    assert nearest_px(faint.xy_px, true_px(bench)).max() < WITHIN_PX


def test_they_are_carried_with_the_gel():
    bench, perception, faint = watched(gel=1, wear=1.0)
    before = true_px(bench)
    bench.until(600)
    bench.grip(0.0236)
    bench.until(1600)
    bench.lift(0.01)
    [frame] = bench.frames(1, 1800)
    observation, _ = perception.observe(frame)
    assert np.hypot(*(true_px(bench) - before).T).max() > 3
    off = nearest_px(faint.carried(observation.field), true_px(bench))
    # Where no tracker follows a dot, it is carried with what its neighbours do on average.
    assert off[faint._followed].max() < WITHIN_PX
    assert off.max() < faint.radius_px


def test_an_unworn_gel_has_none():
    assert not len(watched()[2].xy_px)
