"""Force and torque combined: distance from the limit, slip velocity, and off-centre picks that do not turn."""

from __future__ import annotations

import math
from dataclasses import replace
from statistics import median
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.contracts import ABSTAINED, ContactLoad
from lsds.session.run import run
from lsds.tactile.carried_load import MEDIAN_FRAMES, REMEMBERED_S, CarriedLoad
from lsds.tactile.contact_load import FRICTION_ARM_M, pull_of, speed_of

number = st.floats(-50, 50)


def finger(load, t_ns):
    return SimpleNamespace(
        finger="left", skipped=False, observation=SimpleNamespace(t_ns=t_ns, load=load, contact=None)
    )


@given(number, number, st.floats(-0.5, 0.5), st.floats(0, 2))
def test_a_torque_adds_to_the_force_never_takes_from_it(x, y, torque, share):
    load = ContactLoad((x, y), torque, 0.01, 0.001)
    pull = pull_of(load)
    assert pull >= load.force_n * (1 - 1e-12)
    assert pull == pytest.approx(math.hypot(load.force_n, torque / FRICTION_ARM_M))
    # Force and torque in proportion: so is what friction has to hold.
    assert pull_of(ContactLoad((share * x, share * y), share * torque, 0.01, 0.001)) == pytest.approx(share * pull)
    assert pull_of(replace(load, torque_nm=-torque)) == pull


def test_a_turn_counts_as_slip_and_an_unknown_one_is_left_out():
    still = replace(ABSTAINED, abstained=False, speed_m_s=0.0, speed_std_m_s=0.001, angular_rad_s=2.0)
    assert speed_of(replace(still, angular_std_rad_s=0.2)) == pytest.approx(
        (2 * FRICTION_ARM_M, math.hypot(0.001, 0.2 * FRICTION_ARM_M))
    )
    assert speed_of(replace(still, angular_rad_s=math.nan, angular_std_rad_s=math.nan)) == (0.0, 0.001)
    assert math.isnan(speed_of(ABSTAINED)[0])


def test_the_carried_load_counts_torque():
    carried = CarriedLoad()
    carried.take(0, [finger(ContactLoad((0.0, 0.0), 0.002, 0.01, 0.001), 0)])
    carried.take(40_000_000, [finger(ContactLoad((0.0, 1.0), 0.002 + FRICTION_ARM_M, 0.01, 0.001), 40_000_000)])
    assert carried.now_n == pytest.approx(math.sqrt(2))


@given(st.lists(st.tuples(st.sampled_from([0.0, 0.5, 1.0, 2.0, 3.0]), st.integers(1, 400)), min_size=1, max_size=60))
def test_the_greatest_load_is_the_maximum_of_the_last_second(frames):
    """Of medians of three frames, whatever their order, ties and intervals."""
    carried, t_ns, loads, medians = CarriedLoad(), 0, [0.0], [(0, 0.0)]
    carried.take(0, [finger(ContactLoad((0.0, 0.0), 0.0, 0.01, 0.001), 0)])
    for load_n, interval_ms in frames:
        t_ns += interval_ms * 1_000_000
        carried.take(t_ns, [finger(ContactLoad((0.0, load_n), 0.0, 0.01, 0.001), t_ns)])
        loads.append(load_n)
        medians.append((t_ns, median(loads[-MEDIAN_FRAMES:])))
        late = [value for at_ns, value in medians if t_ns - at_ns <= REMEMBERED_S * 1e9]
        assert carried.greatest_n == pytest.approx(max(late))


@pytest.mark.parametrize(("normal_n", "load_n", "known"), [(0.17, 0.0, True), (0.17, 1.9, False), (2.0, 1.9, True)])
def test_a_normal_force_that_could_not_carry_the_load_is_unknown(normal_n, load_n, known):
    """Simulated: the imprint of a smooth box showed a bump of it only, with 0.17 N of 3.1."""
    carried = CarriedLoad()
    for k, now_n in enumerate([0.0, load_n]):
        carried.take(k * 40_000_000, [finger(ContactLoad((0.0, now_n), 0.0, 0.01, 0.001, normal_n), k * 40_000_000)])
    assert math.isfinite(carried.normal_n) is known


@pytest.mark.parametrize("squeeze_mm", [1.0, 2.0])
def test_an_object_gripped_off_centre_does_not_turn_far(squeeze_mm, installed_host):
    config = [
        "cell.simulated.fidelity=winkler",
        "cell.simulated.centre_x_mm=10.0",
        "cell.simulated.grip_height_mm=75.0",
        "controller.backend=belief",
        f"task.first_squeeze_m={squeeze_mm * 1e-3}",
    ]
    session = run(None, config)
    step_s = (session.truths[1].t_ns - session.truths[0].t_ns) * 1e-9
    turned = sum(truth.slip_angular_rad_s for truth in session.truths) * step_s
    assert session.summary["outcome"] == "held"
    assert abs(math.degrees(turned)) < 12
