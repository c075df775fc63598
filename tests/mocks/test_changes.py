"""Pouring, a shove and a wet patch: what changes, from when on, and that it changes what a grip has to hold."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.plant.changes import Changes

from lsds.session.run import run

QUICK = ["cell.simulated.fidelity=pad", "cell.simulated.grid=1", "cell.simulated.step_ms=4.0", "task.settle_s=0.2"]
FIRM = [*QUICK, "task.grip_aperture_m=0.0205", "controller.enabled=false", "task.lift_s=1.5", "task.hold_s=1.5"]


@given(st.floats(0, 5), st.floats(0.1, 5), st.floats(0.1, 4), st.floats(0, 20))
def test_the_mass_grows_evenly_to_what_was_poured(after_s, pour_s, factor, t_s):
    changes = Changes(after_s=after_s, mass_factor=factor, pour_s=pour_s)
    assert changes.mass(t_s) == 1.0, "nothing begins on the table"
    changes.step(0.0, lifted=True)
    low, high = sorted((1.0, factor))
    assert low - 1e-12 <= changes.mass(t_s) <= high + 1e-12
    assert changes.mass(after_s + pour_s) == pytest.approx(factor)
    middle = changes.mass(after_s + pour_s / 2)
    assert middle == pytest.approx((1 + factor) / 2)


def test_a_shove_is_half_a_sine_and_then_over():
    changes = Changes(after_s=1.0, shove_n=4.0, shove_s=0.2)
    changes.step(2.0, lifted=True)
    assert [changes.push_n(t) for t in (2.9, 3.0, 3.21, 9.0)] == [0.0] * 4
    assert changes.push_n(3.1) == pytest.approx(4.0)
    assert changes.push_n(3.05) == pytest.approx(4.0 * math.sin(math.pi / 4))


def test_it_counts_from_the_first_lift_off():
    changes = Changes(after_s=1.0, friction_factor=0.5)
    changes.step(1.0, lifted=True)
    changes.step(5.0, lifted=True)
    assert (changes.friction(1.9), changes.friction(2.1)) == (1.0, 0.5)


@pytest.mark.parametrize(
    ("change", "factor"),
    [("cell.simulated.pour_to=1.8", 1.8), ("cell.simulated.wet_to=0.6", 1 / 0.6)],
)
def test_what_a_grip_has_to_hold_changes_with_it(change, factor):
    before, after = (
        [truth.required_normal_force_n for truth in run(None, [*FIRM, *extra]).truths][-1]
        for extra in ([], [change, "cell.simulated.pour_s=0.5"])
    )
    assert after == pytest.approx(factor * before, rel=1e-6)


def test_a_shove_loads_the_gel_and_a_weak_grip_slips_where_it_gets_wet():
    loads = [
        max(t.tangential_force_n for t in run(None, [*FIRM, *more]).truths)
        for more in ([], ["cell.simulated.shove_n=2.0"])
    ]
    assert loads[1] == pytest.approx(0.3 * 9.81 / 2 + 1.0, rel=0.05), "two fingers share the shove"
    wet = run(None, [*FIRM, "task.grip_aperture_m=0.0222", "cell.simulated.wet_to=0.4"])
    assert wet.truths[-1].slip_distance_m > 1e-3
