"""A load that falls in one frame has lost its friction; one that falls over some frames was taken, or set down."""

from __future__ import annotations

import pytest

from lsds.grip.jump import LoadJump

FRAME_NS = 40_000_000


def told(loads, calm=20, interval_ns=FRAME_NS):
    """Return after which of the loads, as parts of a calm one before them, it has fallen."""
    jump = LoadJump()
    for k in range(calm):
        jump.see(k * interval_ns, 1.0)
    fell = []
    for k, load in enumerate(loads):
        jump.see((calm + k) * interval_ns, load)
        fell.append(jump.fell)
    return fell


def test_a_load_that_falls_in_one_frame_has_fallen():
    assert told([0.6, 0.55, 0.5]) == [True, False, False]
    assert told([0.75, 0.75]) == [False, False], "an arm that brakes"
    assert told([0.1, 0.05]) == [False, False], "the object was taken"


@pytest.mark.parametrize("frames", [4, 6, 9])
def test_an_object_that_is_set_down_over_some_frames_has_not_lost_its_friction(frames):
    assert not any(told([1 - (k + 1) / frames for k in range(frames)][: frames - 1]))


def test_two_fingers_that_take_turns_show_a_fall_in_two_steps():
    assert told([0.78, 0.56], calm=40, interval_ns=FRAME_NS // 2) == [False, True]
