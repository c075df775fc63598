"""Compiled look-ups of surfaces say what the plain formulas say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.gel.shapes import _WALL, Box
from lsds_mocks.objects.relief import Relief, _wrapped

ANGLE = st.floats(-3.2, 3.2)
EDGE = st.sampled_from([0.0, 0.2e-3, 0.5e-3])


def box_gap(box, x_m, y_m):
    """Face, quarter circle, wall, as arrays."""
    cos, sin = np.cos(box.angle_rad), np.sin(box.angle_rad)
    u, v = x_m * cos + y_m * sin, y_m * cos - x_m * sin
    r = box.edge_m
    across = np.maximum(np.abs(u) - (box.width_m / 2 - r), 0.0)
    along = np.maximum(np.abs(v) - (box.height_m / 2 - r), 0.0)
    away = np.hypot(across, along)
    return np.where(away < r, r - np.sqrt(np.maximum(r * r - away * away, 0.0)), r + _WALL * (away - r)) * (away > 0)


@given(ANGLE, EDGE, st.integers(0, 1000))
def test_a_box_has_a_face_round_edges_and_walls(angle, edge, seed):
    box = Box(8e-3, 5e-3, edge_m=edge, angle_rad=angle)
    at = np.random.default_rng(seed).uniform(-6e-3, 6e-3, (2, 7, 5))
    assert box.gap(*at) == pytest.approx(box_gap(box, *at), abs=1e-15)


def test_points_may_be_axes_or_none_at_all():
    box = Box(8e-3, 5e-3, angle_rad=0.3)
    x, y = np.linspace(-6e-3, 6e-3, 9)[None, :], np.linspace(-4e-3, 4e-3, 6)[:, None]
    assert box.gap(x, y) == pytest.approx(box_gap(box, x, y), abs=1e-15)
    assert box.gap(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0, 3)
    assert Relief(box, np.ones((4, 4), np.float32), 1e-4).gap(np.zeros(0), np.zeros(0)).shape == (0,)


@given(st.floats(-1, 1), st.sampled_from([1e-4, 1 / 3 * 1e-4]), st.integers(1, 300))
def test_a_map_repeats(at_m, pitch_m, size):
    found = float(_wrapped(np.array([at_m]), pitch_m, size)[0, 0])
    expected = (at_m / pitch_m + (size - 1) / 2) % size
    # Both ends are the same place.
    assert min(abs(found - expected), size - abs(found - expected)) < 1e-4 * max(size, 1)
    assert -1e-3 <= found <= size
