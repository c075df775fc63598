"""Place and normal force of the contact, and the allowed squeeze of a fragile object."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.config import load_config
from lsds.contracts import ContactPatch
from lsds.errors import ConfigError
from lsds.grip.fragile import HARDEST_OBJECT_N_M, SAFE, Bearing, allowed_squeeze_m
from lsds.session.run import run
from lsds.tactile.contact_load import PRESSED_N_M3, normal_force_of
from lsds.tactile.contact_place import edge_of, off_centre

PAD_M2 = 3e-4
positive = st.floats(1e-4, 50)


def bump(x=0.0, y=0.0, radius=0.12, depth_m=4e-4):
    """A round dent at a place of the pad, in shares of width and height from its centre."""
    rows, columns = np.mgrid[0:30, 0:40]
    away = np.hypot(columns / 39 - 0.5 - x, 0.75 * (rows / 29 - 0.5 - y))
    depth = (depth_m * np.clip(1 - (away / radius) ** 2, 0, None)).astype(np.float32)
    return ContactPatch(depth, 5e-5, float(np.mean(depth > 5e-5)))


@pytest.mark.parametrize(
    ("at", "edge"),
    [
        ((0, 0), ""),
        ((0.2, 0.1), ""),
        ((0.4, 0), "right"),
        ((-0.4, 0.1), "left"),
        ((0, 0.4), "lower"),
        ((0, -0.4), "upper"),
    ],
)
def test_a_contact_at_the_edge_is_named(at, edge):
    assert edge_of(bump(*at)) == edge


def test_a_face_as_deep_as_the_threshold_is_where_it_is_and_not_where_it_exceeds_that():
    """A block of 12 mm across the whole pad: 43 um deep, and 55 um in its lower right corner."""
    depth = np.full((30, 40), -2e-5, np.float32)
    depth[:, 8:32] = 4.3e-5
    depth[25:, 22:30] = 5.5e-5
    contact = ContactPatch(depth, 5e-5, float(np.mean(depth > 5e-5)))
    assert contact.area_fraction > 0.03
    x, y = off_centre(contact)
    assert abs(x) < 0.05
    assert abs(y) < 0.05
    assert edge_of(contact) == ""


def test_a_faint_contact_is_not_drawn_to_the_background():
    depth = np.full((30, 40), 2.8e-5, np.float32)
    depth[:, 37:39] = 5.5e-5
    contact = ContactPatch(depth, 5e-5, float(np.mean(depth > 5e-5)))
    assert edge_of(contact) == "right"


def test_without_an_imprint_there_is_no_offset_and_no_force():
    assert off_centre(None) == (0, 0)
    assert off_centre(ContactPatch(np.zeros((30, 40), np.float32), 5e-5, 0.0)) == (0, 0)
    assert normal_force_of(None, PAD_M2) is None
    assert normal_force_of(ContactPatch(np.full((30, 40), 4e-5, np.float32), 5e-5, 0.0), PAD_M2) is None


def test_a_soft_object_with_a_small_imprint_has_no_measured_force():
    depth = np.full((30, 40), 4.9e-5, np.float32)
    depth[:7, :7] = 1e-4
    assert normal_force_of(ContactPatch(depth, 5e-5, 49 / 1200), PAD_M2) is None


@given(st.floats(0.17, 0.3), st.floats(2e-4, 8e-4), st.floats(1.1, 2))
def test_a_deeper_imprint_is_pressed_harder(radius, depth_m, more):
    before, after = (normal_force_of(bump(radius=radius, depth_m=each), PAD_M2) for each in (depth_m, more * depth_m))
    assert before is not None
    assert after is not None
    assert after[0] > before[0] > 0
    assert 0 < before[1] < before[0]


@given(st.floats(0.17, 0.3), st.floats(4e-4, 8e-4), st.floats(0, 3e-5))
def test_a_shallow_veil_over_the_pad_adds_little_force(radius, depth_m, veil_m):
    """Wear, light and the dip next to a contact look like shallow contacts, which make up a large volume."""
    dent = bump(radius=radius, depth_m=depth_m)
    veiled = ContactPatch(np.maximum(dent.depth_m, np.float32(veil_m)), dent.threshold_m, dent.area_fraction)
    clear, dim = normal_force_of(dent, PAD_M2), normal_force_of(veiled, PAD_M2)
    assert abs(dim[0] - clear[0]) <= 0.2 * PRESSED_N_M3 * PAD_M2 * veil_m


@given(st.integers(3, 25), st.floats(1e-4, 8e-4))
def test_a_flat_dent_is_pressed_by_its_volume(rows, depth_m):
    depth = np.zeros((30, 40), np.float32)
    depth[:rows, :20] = depth_m
    share = rows * 20 / 1200
    force_n, _ = normal_force_of(ContactPatch(depth, 5e-5, share), PAD_M2)
    assert force_n == pytest.approx(PRESSED_N_M3 * PAD_M2 * share * depth_m, rel=1e-3)


def test_without_a_limit_everything_is_allowed():
    assert allowed_squeeze_m(math.inf, 1e-3, 2.0) == math.inf


@given(positive, st.floats(1e-4, 5e-3), positive)
def test_the_measured_force_stays_below_the_object_s_maximum(fragile, squeeze, normal):
    allowed = allowed_squeeze_m(fragile, squeeze, normal)
    # The force grows at most with the power that is reckoned with.
    force = normal * (allowed / squeeze) ** (1.3 if allowed > squeeze else 1.0)
    assert force == pytest.approx(SAFE * fragile, rel=1e-6)


@given(positive, st.floats(1e-4, 5e-3))
def test_an_unmeasured_object_counts_as_the_hardest(fragile, squeeze):
    hard = allowed_squeeze_m(fragile, squeeze, math.nan)
    assert hard <= allowed_squeeze_m(fragile, squeeze, 0.5 * HARDEST_OBJECT_N_M * squeeze)


def test_an_imprint_that_flickers_opens_nothing():
    """While the imprint has no information, its last result holds."""
    bearing = Bearing()
    for _ in range(5):
        bearing.take(1e-3, 2.0)
    before_m = bearing.allowed_m(3.0, 1e-3)
    for normal_n in (math.nan, 20.0):
        bearing.take(1e-3, normal_n)
        assert bearing.allowed_m(3.0, 1e-3) == pytest.approx(before_m), "one frame may be wrong"


def test_a_fragile_object_needs_a_grasp_by_touch_and_a_controller_that_supports_it():
    with pytest.raises(ConfigError, match="fragile_n"):
        load_config(None, ["task.fragile_n=2.0", 'task.grasp="aperture"'])
    with pytest.raises(ConfigError, match="belief"):
        run(None, ["task.fragile_n=2.0", "controller.backend=pd"])
