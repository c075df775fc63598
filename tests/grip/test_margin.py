"""Controller `margin`: closes on slip by what is missing, opens to the margin and stops there, never on a doubt."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_plugins.controllers.margin import MarginController, MarginOptions

from lsds.clock import VirtualClock
from lsds.contracts import ABSTAINED, BuildContext, ContactLoad, Detection, GripInput, SlipEstimate
from lsds.grip.sure_slip import SureSlip

TOUCH_M = 0.025
FRAME_NS = 40_000_000


class Grip:
    """A grip of 1 N of load a millimetre at the limit; commands are carried out at once."""

    def __init__(self, squeeze_mm, **options):
        self.controller = MarginController(MarginOptions(**options), BuildContext(VirtualClock(), 0))
        self.squeeze_mm, self.t_ns = squeeze_mm, 0
        self.seen_ns = {}

    def frame(self, load_n, slip, speed=0.0, *, std=0.001, touch_m=TOUCH_M, sent_mm=None, slide=None, repeats=""):
        """Show a frame; return the squeeze (mm) then. `load_n` is of one finger, or by finger; the one that `repeats`
        has seen nothing new."""
        self.t_ns += FRAME_NS
        loads = load_n if isinstance(load_n, dict) else {"left": load_n}
        fingers = [
            SimpleNamespace(
                finger=name,
                observation=SimpleNamespace(
                    t_ns=self.seen_ns.get(name, self.t_ns) if name == repeats else self.t_ns,
                    load=None if own is None else ContactLoad((0.0, own), 0.0, 0.01, 0.001),
                ),
            )
            for name, own in loads.items()
        ]
        self.seen_ns = {finger.finger: finger.observation.t_ns for finger in fingers}
        estimate = SlipEstimate((0.0, speed), (std, std), 0.0, 0.0, speed, std)
        aperture = TOUCH_M - self.squeeze_mm * 1e-3
        sent = aperture if sent_mm is None else TOUCH_M - sent_mm * 1e-3
        wanted = self.controller.update(
            GripInput(
                self.t_ns,
                0.04,
                Detection(slip, 1.0, 0.5, 1.0),
                ABSTAINED if slip is None else estimate,
                sent,
                aperture,
                tuple(fingers),
                touch_m,
                aperture,
                slide=slide,
            )
        )
        if wanted is not None:
            self.squeeze_mm = (TOUCH_M - wanted) * 1e3
        return self.squeeze_mm

    def quiet(self, load_n, seconds):
        return [self.frame(load_n, slip=False) for _ in range(round(seconds / 0.04))][-1]


def lifted(squeeze_mm=1.0, **options):
    grip = Grip(squeeze_mm, **options)
    grip.frame(0.0, slip=False)
    return grip


def slipped(load_n=1.0, speed=0.02, **options):
    """A grip that has slipped, for two frames: its limit is 1 N a millimetre and grows to what it held then."""
    grip = lifted(load_n, **options)
    grip.frame(load_n, True, speed)
    grip.squeeze_mm = load_n
    grip.frame(load_n, True, speed)
    return grip


def test_a_grip_that_holds_is_left_alone():
    grip = lifted()
    assert grip.quiet(0.5, 3.0) == 1.0


def test_it_closes_on_slip_in_proportion_and_then_opens_to_the_margin():
    grip = slipped(speed=0.038)
    assert grip.squeeze_mm == pytest.approx(1 + 0.8 * 0.038 / 0.048)
    assert grip.quiet(1.2, 5.0) == pytest.approx(1.2 * 1.2, rel=0.02)


def test_it_follows_a_load_that_grows_before_anything_slips():
    grip = slipped()
    grip.quiet(1.2, 4.0)
    for frame in range(30):
        assert grip.quiet(1.2 + 0.02 * frame, 0.04) == pytest.approx(1.2 * (1.2 + 0.02 * frame), rel=0.05)


def test_a_load_that_jumps_is_answered_at_once_and_not_without_bounds():
    grip = slipped()
    before = grip.quiet(1.2, 5.0)
    assert 1.3 * before < grip.frame(1.5, slip=False) < 1.9 * before
    assert grip.frame(9.0, slip=False) <= 2.01 * before
    assert grip.quiet(1.2, 5.0) == pytest.approx(before, rel=0.03), "and opened again"


def test_an_alarm_while_the_load_jumps_is_a_fast_slip():
    grip = lifted()
    grip.quiet(0.5, 1.0)
    grip.frame(0.7, slip=False)
    grip.squeeze_mm = 1.0
    assert grip.frame(0.7, True, 0.0) == pytest.approx(1.6)
    # What was caught springs back: no load is missing.
    grip.squeeze_mm = 1.6
    grip.frame(0.5, slip=False)
    assert grip.frame(0.2, True, 0.0) < 2.0


def test_an_alarm_long_ago_is_not_a_slip_that_goes_on():
    grip = lifted()
    grip.quiet(0.9, 1.0)
    grip.frame(0.9, True, 0.0)
    for _ in range(25):
        grip.frame(0.9, None)
    assert grip.frame(0.9, True, 0.0) == pytest.approx(1.0)


def test_a_finger_that_saw_nothing_new_confirms_nothing():
    """Two fingers out of step: what one saw last is told again with each frame of the other."""
    grip = Grip(1.0)
    for _ in range(12):
        grip.frame({"left": 0.0, "right": 0.0}, slip=False)
    for at in range(12):
        grip.frame({"left": 0.5, "right": 0.5}, slip=False, repeats=("left", "right")[at % 2])
    grip.frame({"left": 0.5, "right": 5.0}, slip=False, repeats="left")
    grip.frame({"left": 0.5, "right": 5.0}, slip=False, repeats="right")
    assert grip.controller._load.greatest_n == pytest.approx(0.5)
    grip.frame({"left": 0.5, "right": 0.5}, True, 0.0, repeats="left")
    grip.frame({"left": 0.5, "right": 0.5}, True, 0.0, repeats="right")
    assert not grip.controller._limit.known
    grip.frame({"left": 0.5, "right": 0.5}, True, 0.0)
    assert grip.controller._limit.known


def test_a_calm_load_that_falls_at_once_is_answered_before_a_detector_tells_and_let_go_where_nothing_slips():
    grip = slipped()
    before = grip.quiet(1.2, 5.0)
    assert 2.0 * before < grip.frame(0.6, slip=False) <= 2.51 * before
    assert grip.frame(0.6, slip=False) <= 2.51 * before, "frames do not add up"
    assert grip.quiet(1.2, 5.0) == pytest.approx(before, rel=0.03), "and opened again"


def test_before_anything_has_slipped_a_load_that_falls_and_comes_back_leaves_what_held():
    grip = lifted()
    grip.quiet(0.5, 1.0)
    assert grip.frame(0.3, slip=False) > 1.5
    assert grip.quiet(0.5, 5.0) == pytest.approx(1.0, abs=0.02)


def test_a_load_that_an_arm_lightens_or_that_is_taken_away_closes_nothing():
    for left in (0.85, 0.1):
        grip = slipped()
        before = grip.quiet(1.2, 5.0)
        assert grip.frame(left, slip=False) == pytest.approx(before, abs=1e-4)


def test_one_frame_of_great_load_raises_no_limit_when_a_slip_begins():
    grip = lifted(2.0)
    grip.quiet(1.0, 1.2)
    grip.frame(1.0, True, 0.03)
    grip.frame(3.0, True, 0.03)
    assert grip.controller._limit.limit < 1000


def test_openings_that_are_lost_do_not_add_up():
    grip = slipped(speed=0.1)
    closed = grip.quiet(0.5, 0.2)
    for _ in range(100):
        grip.frame(0.5, slip=False)
        grip.squeeze_mm = closed
    assert grip.frame(0.5, slip=False) > closed - 0.31


def test_noise_at_rest_is_no_certain_slip():
    """A speed has no sign: its mean at rest is not zero."""
    rng = np.random.default_rng(0)
    sure = SureSlip()
    told = []
    for at in range(3000):
        x, y, turn = rng.normal(0, (0.003, 0.003, 0.4))
        estimate = SlipEstimate((x, y), (0.003, 0.003), turn, 0.4, math.hypot(x, y), 0.003)
        told.append(sure.see(at * FRAME_NS, estimate))
    assert np.mean(told) < 0.02


def test_a_load_that_grows_is_followed_before_anything_has_slipped():
    grip = lifted()
    grip.quiet(0.5, 1.0)
    assert grip.quiet(0.54, 1.0) == 1.0, "an arm that starts is no load that grows"
    assert grip.quiet(1.0, 1.0) == pytest.approx(1.0 / (0.5 * 1.1), rel=0.03)
    assert 2.4 < grip.quiet(20.0, 1.0) < 2.8, "so far, as nothing is known"


def test_a_load_that_jumps_before_anything_has_slipped_is_answered_and_then_let_go_to_what_held():
    grip = lifted()
    grip.quiet(0.5, 1.0)
    assert grip.frame(0.65, slip=False) > 1.3
    assert grip.quiet(0.5, 5.0) == pytest.approx(1.0, abs=0.02)


def test_one_frame_of_great_load_is_forgotten():
    grip = lifted()
    grip.quiet(0.5, 1.0)
    assert grip.frame(5.0, slip=False) < 2.01
    assert grip.quiet(0.5, 5.0) == pytest.approx(1.0, abs=0.02)


def test_a_load_that_is_lighter_for_a_moment_opens_nothing():
    grip = slipped()
    before = grip.quiet(1.2, 5.0)
    assert grip.quiet(0.9, 0.5) == pytest.approx(before, abs=1e-4)


def test_it_does_not_open_because_the_load_is_gone():
    """The object was set down, or the hand was turned: the load may be back at once."""
    grip = slipped()
    before = grip.quiet(1.2, 5.0)
    assert grip.quiet(0.2, 10.0) == before


def test_alarms_before_anything_pulls_do_not_ratchet():
    grip = lifted(1.0)
    for _ in range(3):
        grip.frame(0.01, True, 0.0)
    for step in range(100):
        grip.frame(0.01 * step, slip=False)
    assert grip.quiet(1.0, 2.0) < 1.3


def test_a_single_alarm_does_not_make_the_grip_follow_the_load():
    grip = lifted(1.0)
    grip.quiet(0.2, 0.2)
    grip.frame(0.2, True, 0.0)
    for step in range(50):
        grip.frame(0.2 + 0.01 * step, slip=False)
    assert grip.squeeze_mm < 1.3


def test_a_slip_is_caught_without_a_load_too():
    grip = lifted()
    assert grip.frame(None, True, 0.02) == pytest.approx(1 + 0.8 * 0.02 / 0.03)


def test_nothing_opens_while_the_load_is_stale():
    grip = slipped()
    grip.quiet(1.0, 0.2)
    before = grip.squeeze_mm
    assert grip.quiet(None, 3.0) == before


def test_nothing_opens_while_an_alarm_is_in_doubt():
    grip = slipped(speed=0.1)
    grip.quiet(0.9, 0.6)
    before = grip.squeeze_mm
    grip.controller._limit.limit = 2000.0
    for _ in range(4):
        assert grip.frame(0.9, True, 0.0) >= before
    assert grip.quiet(0.9, 1.0) < before


def test_a_finger_that_is_first_seen_under_load_does_not_count():
    grip = slipped()
    before = grip.quiet(1.2, 5.0)
    for _ in range(50):
        grip.frame({"left": 1.2, "right": 7.0}, slip=False)
    assert grip.squeeze_mm == pytest.approx(before, abs=1e-3)


def test_a_finger_that_falls_silent_changes_no_mean():
    grip = Grip(1.0)
    grip.frame({"left": 0.0, "right": 0.0}, slip=False)
    for _ in range(30):
        grip.frame({"left": 1.0, "right": 0.5}, slip=False)
    assert grip.controller._load.now_n == pytest.approx(0.75)
    grip.frame({"left": 1.0, "right": None}, slip=False)
    assert grip.controller._load.now_n == pytest.approx(0.75)


def test_a_closing_that_was_lost_is_said_again():
    grip = lifted()
    grip.squeeze_mm = 1.0
    assert grip.frame(0.5, True, 0.0, sent_mm=2.0) == pytest.approx(2.0), "while it slips at once"
    grip = lifted()
    for _ in range(20):
        grip.squeeze_mm = 1.0
        last = grip.frame(0.5, slip=False, sent_mm=2.0)
    assert last == pytest.approx(2.0)


def test_an_alarm_below_what_was_held_is_refuted():
    grip = lifted(2.0)
    grip.quiet(1.6, 1.0)
    assert grip.frame(1.0, True, 0.02) > 2.0  # The load has fallen: this may be a wet surface.
    grip = lifted(2.0)
    grip.quiet(1.6, 1.0)
    grip.controller._limit.held = 3000.0
    assert grip.frame(1.6, True, 0.02) == 2.0


def test_alarms_that_go_on_are_believed():
    grip = lifted(2.0)
    grip.quiet(1.6, 1.0)
    grip.controller._limit.held = 3000.0
    assert [grip.frame(1.6, True, 0.02) for _ in range(7)][-1] > 2.0


def test_a_sure_speed_is_a_slip_that_the_detector_missed():
    grip = lifted()
    assert grip.frame(0.9, slip=False, speed=0.03) == 1.0
    assert grip.frame(0.9, slip=False, speed=0.03) > 1.0


def test_two_fingers_see_the_same_frame_once():
    grip = lifted()
    grip.frame(0.9, slip=False, speed=0.03)
    grip.t_ns -= FRAME_NS - 1_000_000
    assert grip.frame(0.9, slip=False, speed=0.03) == 1.0


def test_what_is_in_doubt_in_every_frame_is_certain_after_many():
    grip = lifted()
    for _ in range(30):
        grip.frame(0.9, slip=False, speed=0.009, std=0.005)
    assert grip.squeeze_mm > 1.0


def test_a_doubtful_speed_is_none():
    grip = lifted()
    for _ in range(5):
        assert grip.frame(0.9, slip=False, speed=0.03, std=0.02) == 1.0


@given(
    st.lists(
        st.tuples(
            st.one_of(st.none(), st.floats(0, 50)),
            st.sampled_from([True, False, None]),
            st.one_of(st.just(math.nan), st.floats(0, 0.5)),
        ),
        max_size=60,
    ),
    st.sampled_from([TOUCH_M, math.nan]),
)
def test_it_never_opens_beyond_the_touch_nor_on_a_doubt(frames, touch_m):
    grip = lifted()
    for load, slip, speed in frames:
        before = grip.squeeze_mm
        after = grip.frame(load, slip, speed, touch_m=touch_m)
        assert math.isfinite(after)
        assert after >= 0
        if slip is not False or load is None:
            assert after >= before
        assert after <= 25.0


def test_without_release_it_never_opens():
    grip = slipped(speed=0.1, release_m_s=0.0)
    assert not grip.controller.may_open
    closed = grip.squeeze_mm
    assert closed > 1.5
    assert grip.quiet(1.0, 5.0) == closed


def test_a_grip_begins_with_nothing_known():
    grip = slipped()
    grip.controller.reset()
    before = grip.squeeze_mm
    grip.frame(0.0, slip=False)
    assert grip.quiet(3.0, 2.0) == before


def test_a_slip_without_any_load_left_closes_by_the_most_that_is_allowed():
    grip = lifted()
    grip.quiet(1.0, 0.5)
    assert grip.frame(0.0, True, 0.1) == pytest.approx(3.0)
