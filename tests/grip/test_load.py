"""Load: shear force and torque from the displacement of the dots."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.contracts import ContactLoad, DeformationField, MarkerReference
from lsds.tactile.contact_load import load_of

SHEAR_N_M3 = 2.72e7
M_PER_PX = 6e-5
PITCH_PX = 32.0


def reference(rows=7, columns=9):
    row, column = np.mgrid[0:rows, 0:columns]
    cell = np.stack([row.ravel(), column.ravel()], axis=1)
    xy = (cell[:, ::-1] - [(columns - 1) / 2, (rows - 1) / 2]) * PITCH_PX + [160.0, 120.0]
    return MarkerReference(xy, cell, (rows, columns), (PITCH_PX, PITCH_PX), np.eye(2), (320, 240))


def field(displacement_m, valid=None, own=None):
    own = own or reference()
    position = (own.xy_px - [160.0, 120.0]) * M_PER_PX
    moved = np.broadcast_to(displacement_m, position.shape).astype(float)
    valid = np.ones(own.count, bool) if valid is None else valid
    moved = np.where(valid[:, None], moved, np.nan)
    return DeformationField(0, 0, 0.04, own, position, moved, np.zeros_like(moved), valid)


CELL_M2 = (PITCH_PX * M_PER_PX) ** 2
micrometres = st.floats(-300, 300).map(lambda um: um * 1e-6)


@given(micrometres, micrometres)
def test_a_pad_that_is_sheared_evenly_carries_its_area_times_the_shear(x, y):
    load = load_of(field([x, y]), M_PER_PX, SHEAR_N_M3)
    assert load.shear_n == pytest.approx((63 * CELL_M2 * SHEAR_N_M3 * x, 63 * CELL_M2 * SHEAR_N_M3 * y), abs=1e-9)
    assert load.torque_nm == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-0.02, 0.02))
def test_a_pad_that_is_turned_carries_a_torque_of_its_sign_and_no_force(angle):
    own = reference()
    position = (own.xy_px - [160.0, 120.0]) * M_PER_PX
    turned = angle * np.stack([-position[:, 1], position[:, 0]], axis=1)
    load = load_of(field(turned), M_PER_PX, SHEAR_N_M3)
    assert load.force_n == pytest.approx(0.0, abs=1e-9)
    assert load.torque_nm == pytest.approx(angle * CELL_M2 * SHEAR_N_M3 * float((position**2).sum()), abs=1e-12)


@given(
    st.sets(st.integers(0, 62), max_size=25),
    micrometres,
    st.lists(st.floats(-0.05, 0.05), min_size=4, max_size=4),
)
def test_lost_dots_change_no_load_of_a_pad_that_is_stretched_evenly(lost, y, stretch):
    own = reference()
    position = (own.xy_px - [160.0, 120.0]) * M_PER_PX
    # A press spreads the dots: the mean of those that are left says little of the lost ones.
    moved = position @ np.reshape(stretch, (2, 2)) + [0.0, y]
    valid = np.ones(63, bool)
    valid[list(lost)] = False
    whole, left = (load_of(field(moved, own=own, valid=v), M_PER_PX, SHEAR_N_M3) for v in (None, valid))
    assert left.shear_n == pytest.approx(whole.shear_n, abs=1e-9)
    assert left.torque_nm == pytest.approx(whole.torque_nm, abs=1e-12)


def test_lost_dots_of_an_uneven_field_add_to_the_uncertainty():
    rng = np.random.default_rng(0)
    moved = rng.normal(0, 1e-4, (63, 2))
    valid = np.arange(63) % 3 > 0
    whole, left = (load_of(field(moved, valid=v), M_PER_PX, SHEAR_N_M3) for v in (None, valid))
    assert left.shear_std_n > 2 * whole.shear_std_n
    assert math.dist(left.shear_n, whole.shear_n) < 3 * left.shear_std_n


def test_with_too_few_dots_there_is_no_load():
    valid = np.zeros(63, bool)
    valid[:20] = True
    assert load_of(field([0, 1e-4], valid), M_PER_PX, SHEAR_N_M3) is None


def test_the_uncertainty_grows_with_the_load_and_never_vanishes():
    still, pulled = load_of(field([0, 0]), M_PER_PX, SHEAR_N_M3), load_of(field([0, 2e-4]), M_PER_PX, SHEAR_N_M3)
    assert 0 < still.shear_std_n < pulled.shear_std_n < pulled.force_n
    assert still.torque_std_nm > 0


def test_what_has_been_added_is_a_difference():
    before, now = ContactLoad((0.1, 0.2), 0.01, 0.05, 0.001), ContactLoad((0.4, 0.6), 0.03, 0.07, 0.002)
    added = now.since(before)
    assert added.force_n == pytest.approx(math.hypot(0.3, 0.4))
    assert added.torque_nm == pytest.approx(0.02)
    assert added.shear_std_n == 0.07
