"""A clamped object stays where it is: the arm slides along it and rotates about it, at the commanded speed."""

import math

import pytest
from lsds_mocks.cell.build import build_plant
from lsds_mocks.cell.options import CellOptions


def plant(closure_m=1.8e-3, **options):
    chosen = {"object": "can", "fidelity": "winkler", "vibration_um": 0.0, "clamped": True, **options}
    made = build_plant(CellOptions(**chosen), [0])
    made.fingers.aperture_m = made.fingers.target_m = 45e-3 - closure_m
    for _ in range(200):
        made.step(0.002)
    return made


def go(made, seconds, rise=0.0, turn=0.0):
    made.arm.target_m_s, made.turn.target_m_s, made.turn.limit_m_s2 = rise, turn, 40.0
    for _ in range(round(seconds / 0.002)):
        made.step(0.002)
    return made.truth(0)


def test_the_grip_slides_along_it_and_does_not_lift_it():
    made = plant()
    truth = go(made, 0.8, rise=0.03)
    assert truth.slip_velocity_m_s == pytest.approx((0.0, 0.03), abs=1e-6)
    assert (truth.object_height_m, truth.supported) == (0.0, True)
    assert made.travel_m == pytest.approx(made.arm.position_m - made.parameters.grip_height_m)


def test_turning_about_it_far_from_where_it_was_first_gripped_is_no_sliding():
    made = plant()
    go(made, 1.0, rise=0.03)
    go(made, 0.3)
    travelled = made.travel_m
    truth = go(made, 0.8, turn=1.0)
    assert truth.slip_angular_rad_s == pytest.approx(1.0)
    assert math.hypot(*truth.slip_velocity_m_s) < 1e-6
    assert made.travel_m == pytest.approx(travelled)


def test_a_firm_grip_lifts_it_unless_it_is_clamped():
    height = [go(plant(5e-3, clamped=clamped), 0.5, rise=0.03).object_height_m for clamped in (False, True)]
    assert height[0] > 5e-3
    assert height[1] == 0
