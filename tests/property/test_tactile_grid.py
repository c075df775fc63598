"""Grid identification for any print and rotation, with missing markers and dirt."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_plugins.trackers.dotted.grid import identify_grid
from tactile.render import HEIGHT, WIDTH, pad_positions
from tactile.scenes import PADS

pads = st.sampled_from(sorted(PADS))
seeds = st.integers(0, 10_000)


def printed(pad, angle, pincushion, seed):
    return pad_positions(*pad, PADS[pad], pincushion, angle, 0.15, seed)


def dirt(pad, angle, count, seed, clear=0.42):
    """Points at least `clear` pitches (in the larger of both directions) from every node of the undistorted lattice."""
    rng = np.random.default_rng(seed)
    pitch = np.array(PADS[pad])
    cos, sin = np.cos(angle), np.sin(angle)
    offset = np.array([(n - 1) / 2 for n in pad[::-1]])
    cell = (
        rng.integers(-2, 12, (count, 2))
        + np.where(rng.random((count, 1)) < 0.5, [0.5, 0.0], [0.0, 0.5])
        + rng.uniform(clear - 0.5, 0.5 - clear, (count, 2))
    )
    return (cell - offset) * pitch @ np.array([[cos, sin], [-sin, cos]]) + [(WIDTH - 1) / 2, (HEIGHT - 1) / 2]


def check(grid, pad, true_cell, real):
    """Only real dots, every cell once, cells right up to where counting starts, the shape that the dots span."""
    assert grid is not None
    assert real[grid.index].all(), "dirt was taken for a dot"
    assert len({tuple(c) for c in grid.cell.tolist()}) == len(grid.cell), "a cell was given twice"
    found = true_cell[grid.index]
    assert (np.ptp(found - grid.cell, axis=0) == 0).all(), "a cell is wrong"
    assert (grid.cell.min(axis=0) == 0).all()
    assert grid.shape == tuple(np.ptp(found, axis=0) + 1)
    assert grid.shape[0] <= pad[0]
    assert grid.shape[1] <= pad[1]


@given(pads, st.floats(-40, 40), st.floats(-0.03, 0.08), st.floats(0, 0.15), seeds)
def test_every_dot_gets_its_cell_when_turned_distorted_and_with_dots_missing(pad, degrees, pincushion, missing, seed):
    xy = printed(pad, np.deg2rad(degrees), pincushion, seed)
    order = np.random.default_rng(seed).permutation(len(xy))
    keep = order[int(np.floor(missing * len(xy))) :]
    true_cell = np.stack(np.divmod(keep, pad[1]), axis=1)
    grid = identify_grid(xy[keep])
    check(grid, pad, true_cell, np.ones(len(keep), bool))
    assert len(grid.index) == len(keep), "a dot was left out"
    turned = np.array([[np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))]])
    assert np.abs(grid.axes[0] - turned).max() < 0.05
    assert grid.pitch_px == pytest.approx(PADS[pad], rel=0.08)


@settings(max_examples=200)
@given(pads, st.floats(-40, 40), st.floats(0, 0.15), st.integers(1, 8), seeds)
def test_blobs_off_the_grid_get_no_cell_and_spoil_none(pad, degrees, missing, blobs, seed):
    angle = np.deg2rad(degrees)
    # No pincushion here: a blob off the straight lattice could lie on the continuation of a distorted one.
    xy = printed(pad, angle, 0.0, seed)
    keep = np.random.default_rng(seed).permutation(len(xy))[int(missing * len(xy)) :]
    points = np.concatenate([xy[keep], dirt(pad, angle, blobs, seed)])
    real = np.arange(len(points)) < len(keep)
    true_cell = np.full((len(points), 2), -99)
    true_cell[: len(keep)] = np.stack(np.divmod(keep, pad[1]), axis=1)
    order = np.random.default_rng(seed + 1).permutation(len(points))
    grid = identify_grid(points[order])
    check(grid, pad, true_cell[order], real[order])
    assert len(grid.index) >= len(keep) - 2


@pytest.mark.parametrize("pad", sorted(PADS))
def test_a_whole_pad_has_its_shape(pad):
    grid = identify_grid(printed(pad, 0.1, 0.04, 3))
    assert grid.shape == pad
    assert len(grid.index) == pad[0] * pad[1]


@pytest.mark.parametrize("points", [0, 1, 3])
def test_a_few_points_are_no_grid(points):
    assert identify_grid(np.random.default_rng(0).uniform(0, 200, (points, 2))) is None


@pytest.mark.parametrize("count", [4, 9, 20])
def test_points_in_one_line_are_no_grid(count):
    line = np.stack([np.arange(count) * 30.0, np.full(count, 100.0)], axis=1)
    assert identify_grid(line) is None


def test_points_in_one_place_are_no_grid():
    assert identify_grid(np.full((10, 2), 50.0)) is None


@given(seeds, st.integers(4, 60))
def test_scattered_points_never_crash_and_never_share_a_cell(seed, count):
    grid = identify_grid(np.random.default_rng(seed).uniform(0, 300, (count, 2)))
    if grid is not None:
        assert len({tuple(c) for c in grid.cell.tolist()}) == len(grid.index) == len(set(grid.index.tolist()))
        assert (grid.cell >= 0).all()
        assert (grid.cell < grid.shape).all()
