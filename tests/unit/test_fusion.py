"""Fusion of several fingers: mirrored if they face each other, weighted by their variance."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.contracts import Detection, FingerCycle, SlipEstimate
from lsds.runtime.fusion import fused_detection, fused_estimate

numbers = st.floats(-0.1, 0.1)
deviations = st.floats(1e-5, 0.1)


def finger(name="left", *, slip=False, confidence=0.5, opposite=False, estimate=None):
    detection = Detection(slip, 0.1, 0.05, confidence)
    return FingerCycle(name, None, None, None, detection, estimate, opposite)


def moving(x=0.0, y=0.0, turn=0.0, speed=None, std=1e-3, *, abstained=False):
    speed = math.hypot(x, y) if speed is None else speed
    return SlipEstimate((x, y), (std, std), turn, std, speed, std, abstained)


def test_one_finger_has_the_only_word():
    alone = finger(slip=True, estimate=moving(0.01))
    assert fused_detection([alone]) is alone.detection
    assert fused_estimate([alone]) is alone.estimate


def test_a_lone_opposite_finger_is_mirrored_too():
    alone = finger("right", opposite=True, estimate=moving(0.01, 0.02, 0.3))
    seen = fused_estimate([alone])
    assert seen.velocity_m_s == pytest.approx((-0.01, 0.02))
    assert seen.angular_rad_s == pytest.approx(-0.3)


def test_one_finger_that_slips_is_slip_and_the_surest_speaks():
    holds, slips = finger(confidence=0.9), finger("right", slip=True, confidence=0.2)
    assert fused_detection([holds, slips]) is slips.detection
    surer = finger("third", slip=True, confidence=0.8)
    assert fused_detection([slips, surer]) is surer.detection


def test_without_slip_the_least_sure_speaks_and_abstention_is_no_vote():
    sure, unsure, silent = finger(confidence=0.9), finger("right", confidence=0.1), finger("third", slip=None)
    assert fused_detection([sure, unsure, silent]) is unsure.detection
    assert fused_detection([silent, silent]).slip is None


@given(numbers, numbers, numbers, deviations)
def test_fingers_that_face_each_other_and_see_the_same_agree(x, y, turn, std):
    left = finger(estimate=moving(x, y, turn, std=std))
    right = finger("right", opposite=True, estimate=moving(-x, y, -turn, std=std))
    both = fused_estimate([left, right])
    assert both.velocity_m_s == pytest.approx((x, y), abs=1e-12)
    assert both.angular_rad_s == pytest.approx(turn, abs=1e-12)
    assert both.speed_m_s == pytest.approx(math.hypot(x, y), abs=1e-12)
    assert both.speed_std_m_s == pytest.approx(std / math.sqrt(2))


@given(numbers, numbers, deviations, deviations)
def test_the_surer_finger_weighs_more_and_both_are_surer_than_one(a, b, std_a, std_b):
    one, two = finger(estimate=moving(y=a, std=std_a)), finger("right", estimate=moving(y=b, std=std_b))
    both = fused_estimate([one, two])
    assert min(a, b) - 1e-12 <= both.velocity_m_s[1] <= max(a, b) + 1e-12
    assert both.velocity_std_m_s[1] <= min(std_a, std_b) + 1e-15
    nearer = a if std_a < std_b else b
    assert abs(both.velocity_m_s[1] - nearer) <= abs(a - b) / 2 + 1e-12


def test_abstaining_fingers_are_ignored_and_if_all_abstain_so_does_the_result():
    silent = finger(estimate=moving(0.05, abstained=True))
    moves = finger("right", opposite=True, estimate=moving(0.02, 0.01, 0.3))
    both = fused_estimate([silent, moves])
    assert both.velocity_m_s == pytest.approx((-0.02, 0.01))
    assert both.angular_rad_s == pytest.approx(-0.3)
    assert fused_estimate([silent, silent]).abstained


def test_a_finger_that_claims_to_be_certain_leaves_numbers():
    certain = finger(estimate=moving(0.01, std=0.0))
    assert math.isfinite(fused_estimate([certain, finger("right", estimate=moving(0.02))]).speed_m_s)
