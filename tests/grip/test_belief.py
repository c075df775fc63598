"""The belief about a grip: a probability that learns the limit from a slide and gives the squeeze that a load needs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lsds.contracts import Detection, SlipEstimate
from lsds.grip.belief import FORGET_S, MEDIAN_FRICTION, WET_SHARE, GripBelief
from lsds.grip.evidence import MOST_EVIDENCE, Evidence, SlipEvidence, probability
from lsds.grip.options import GripOptions

OPTIONS = GripOptions()

FRAME_S = 0.04
TICK_MM = 0.22
LIMIT = 0.9
"""Friction limit of these scenes, N / mm^p."""


def both(ratio: float) -> Evidence:
    """Evidence that says the same of a slide that lasts and of one that has just begun."""
    return Evidence(ratio, ratio)


def sliding(belief: GripBelief, squeeze_mm: float, frames: int = 6, evidence: float = 2.0) -> None:
    for _ in range(frames):
        belief.update(LIMIT * squeeze_mm**OPTIONS.power / OPTIONS.kinetic, squeeze_mm, FRAME_S, both(evidence))


def hanging(belief: GripBelief, load_n: float, squeeze_mm: float, frames: int = 25) -> None:
    for _ in range(frames):
        belief.update(load_n, squeeze_mm, FRAME_S, both(-0.3))


@settings(max_examples=60)
@given(
    frames=st.lists(
        st.tuples(st.floats(0, 60), st.floats(0.3, 20), st.floats(0, 0.2), st.floats(-9, 9), st.booleans()),
        min_size=1,
        max_size=30,
    )
)
def test_it_stays_a_probability(frames):
    belief = GripBelief(OPTIONS, 0.105)
    for load_n, squeeze_mm, dt_s, evidence, stands in frames:
        belief.update(load_n, squeeze_mm, dt_s, both(evidence), stands)
        assert belief.stick.min() >= 0
        assert belief.slide.min() >= 0
        assert belief.stick.sum() + belief.slide.sum() == pytest.approx(1, abs=1e-9)
        required = belief.squeeze_mm(0.25, 1.2, max(load_n, 0.03))
        assert math.isfinite(required)
        assert required > 0


@given(risk=st.floats(0.02, 0.5), more=st.floats(1.01, 3), load_n=st.floats(0.1, 5))
def test_less_risk_more_margin_and_more_load_need_more_squeeze(risk, more, load_n):
    belief = GripBelief(OPTIONS, 0.105)
    sliding(belief, 1.5)
    hanging(belief, 0.8, 2.5)
    squeeze = belief.squeeze_mm(risk, 1.2, load_n)
    assert belief.squeeze_mm(risk / more, 1.2, load_n) >= squeeze - 1e-9
    assert belief.squeeze_mm(risk, 1.2 * more, load_n) > squeeze
    assert belief.squeeze_mm(risk, 1.2, load_n * more) >= squeeze - 1e-9


def test_a_slide_and_its_end_are_both_accepted():
    belief = GripBelief(OPTIONS, 0.105)
    sliding(belief, 1.5)
    assert belief.slips > 0.9
    hanging(belief, 0.9, 2.5)
    assert belief.slips < 0.05


def test_a_detector_that_only_alarms_is_no_evidence_for_long():
    """A load that stays while the squeeze grows is that of an object that hangs, whatever the detector reports."""
    belief, evidence = GripBelief(OPTIONS, 0.105), SlipEvidence(0.105)
    hanging(belief, 0.8, 1.5)
    squeeze_mm = 1.5
    for _ in range(150):
        belief.update(0.8, squeeze_mm, FRAME_S, evidence.take(detection(0.95), SLOW, 1.0))
        squeeze_mm = max(squeeze_mm, min(belief.squeeze_mm(0.25, 1.2, 0.8), 1.2 * squeeze_mm))
    assert squeeze_mm < 3.0
    assert belief.slips < 0.5


def test_after_a_slide_the_limit_is_known():
    belief = GripBelief(OPTIONS, 0.105)
    sliding(belief, 1.5)
    sliding(belief, 1.8)
    hanging(belief, 1.0, 2.5)
    needed_mm = (1.0 / LIMIT) ** (1 / OPTIONS.power)
    assert belief.squeeze_mm(0.5, 1.0, 1.0) == pytest.approx(needed_mm, rel=0.15)


def test_the_published_limit_is_that_of_the_object_within_its_spread():
    belief = GripBelief(OPTIONS, 0.105)
    _, before_n = belief.limit_n(2.5)
    sliding(belief, 1.5)
    sliding(belief, 1.8)
    hanging(belief, 1.4, 2.5)
    limit_n, std_n = belief.limit_n(2.5)
    assert limit_n == pytest.approx(LIMIT * 2.5**OPTIONS.power, abs=2 * std_n)
    assert std_n < 0.5 * before_n


def test_a_grip_that_never_slipped_is_left_alone():
    belief = GripBelief(OPTIONS, 0.105)
    for load_n in np.linspace(0.05, 0.5, 12):
        belief.update(float(load_n), 1.4, FRAME_S, both(-0.5))
    hanging(belief, 0.5, 1.4, 50)
    assert belief.squeeze_mm(0.25, 1.2, 0.5) < 1.4 + TICK_MM / 2


@given(normal_n=st.floats(0.3, 20), squeeze_mm=st.floats(0.5, 5))
def test_the_limit_is_expected_near_friction_times_the_normal_force(normal_n, squeeze_mm):
    belief = GripBelief(OPTIONS, 0.105)
    unknown_n, unknown_std_n = belief.limit_n(squeeze_mm)
    belief.know_normal(normal_n, squeeze_mm)
    limit_n, std_n = belief.limit_n(squeeze_mm)
    assert belief.stick.sum() + belief.slide.sum() == pytest.approx(1, abs=1e-9)
    # Limits of a thirtieth of N/mm^p, and of ten, are far enough from the ends of the grid.
    if 0.03 < MEDIAN_FRICTION * normal_n / squeeze_mm**OPTIONS.power < 10:
        assert limit_n == pytest.approx(MEDIAN_FRICTION * normal_n, rel=0.25)
    assert std_n / limit_n < 0.8 * unknown_std_n / unknown_n


@given(normal_n=st.floats(0.1, 60), squeeze_mm=st.floats(0.3, 20), evidence=st.floats(-4, 4))
def test_a_light_load_does_not_slide_for_a_normal_force(normal_n, squeeze_mm, evidence):
    belief = GripBelief(OPTIONS, 0.105)
    hanging(belief, 0.3, squeeze_mm, frames=3)
    belief.update(0.3, squeeze_mm, FRAME_S, both(evidence))
    slips = belief.slips
    belief.know_normal(normal_n, squeeze_mm)
    assert belief.stick.sum() + belief.slide.sum() == pytest.approx(1, abs=1e-9)
    if MEDIAN_FRICTION * normal_n > 4 * 0.3:
        assert belief.slips <= slips + 0.02


def test_a_load_that_friction_hardly_carries_may_slide():
    """A pipe slid for 0.7 s at a load of 0.54 times the normal force before its slide was believed."""
    seen, blind = GripBelief(OPTIONS, 0.105), GripBelief(OPTIONS, 0.105)
    seen.know_normal(1.43, 1.0)
    for belief in (seen, blind):
        for load_n, evidence in ((0.65, -1.9), (0.78, 1.0), (0.78, 2.5)):
            belief.update(load_n, 1.0, FRAME_S, both(evidence), moved_mm=0.4)
    assert seen.slips > 1.2 * blind.slips


def test_alarms_about_a_light_object_in_a_firm_grip_are_not_believed():
    """0.1 N cannot slide under 15 N. Two alarms closed the fingers on a marble to 40 times the needed force."""
    seen, blind = GripBelief(OPTIONS, 0.105), GripBelief(OPTIONS, 0.105)
    seen.know_normal(15.0, 5.0)
    for belief in (seen, blind):
        for load_n, evidence in ((0.1, 4.0), (0.06, 4.0), (0.15, 0.0)):
            belief.update(load_n, 5.0, FRAME_S, both(evidence))
    assert seen.slips < 0.5 * blind.slips
    assert seen.squeeze_mm(0.1, 1.2, 0.15) < 5.0


def test_holding_for_long_proves_no_more_than_holding_once():
    short, long = GripBelief(OPTIONS, 0.105), GripBelief(OPTIONS, 0.105)
    for belief, frames in ((short, 10), (long, 500)):
        sliding(belief, 1.5)
        hanging(belief, 0.9, 2.5, frames)
    once, again = (belief.squeeze_mm(0.25, 1.2, 0.9) for belief in (short, long))
    assert again == pytest.approx(once, rel=0.1)


def test_a_plateau_that_follows_the_squeeze_slides():
    belief = GripBelief(OPTIONS, 0.105)
    for squeeze_mm in (1.4, 1.4, 1.4, 1.6, 1.6, 1.8, 1.8, 2.0, 2.0):
        belief.update(LIMIT * squeeze_mm**OPTIONS.power / OPTIONS.kinetic, squeeze_mm, FRAME_S, both(0.4))
    assert belief.slips > 0.5


def test_one_that_does_not_follow_it_hangs():
    belief = GripBelief(OPTIONS, 0.105)
    for squeeze_mm in (1.4, 1.4, 1.4, 1.6, 1.6, 1.8, 1.8, 2.0, 2.0):
        belief.update(1.0, squeeze_mm, FRAME_S, both(0.4))
    assert belief.slips < 0.1


def test_a_supported_object_keeps_its_load_while_the_arm_waits_and_does_not_slide():
    informed, uninformed = GripBelief(OPTIONS, 0.105), GripBelief(OPTIONS, 0.105)
    for belief, moved_mm in ((informed, 0.0), (uninformed, math.inf)):
        sliding(belief, 1.9)
        load_n = LIMIT * 1.9**OPTIONS.power / OPTIONS.kinetic
        # The squeeze has grown by two thirds, and the detector takes the motion of the gel for slip.
        belief.update(load_n, 3.1, FRAME_S, both(1.0), True, moved_mm)
    assert informed.slips < 0.1
    assert informed.slips < uninformed.slips


@pytest.mark.parametrize(("moved_mm", "explained"), [(0.4, True), (0.01, False)])
def test_a_load_rises_with_the_way_of_the_arm_or_something_else_happens(moved_mm, explained):
    belief = GripBelief(OPTIONS, 0.105)
    belief.update(0.5, 4.0, FRAME_S, both(0.0), False, 0.4)
    before = belief.slips
    belief.update(1.2, 4.0, FRAME_S, both(0.0), False, moved_mm)
    usual = GripBelief(OPTIONS, 0.105)
    usual.update(0.5, 4.0, FRAME_S, both(0.0), False, 0.4)
    usual.update(1.2, 4.0, FRAME_S, both(0.0))
    assert (belief.slips < usual.slips) is explained
    assert before < 0.1


SLOW = SlipEstimate((0.008, 0.0), (0.001, 0.001), 0.0, 0.1, 0.008, 0.001)
REST = SlipEstimate((0.0, 0.0), (0.001, 0.001), 0.0, 0.1, 0.0, 0.001)


def detection(score: float, *, threshold: float = 0.75, slip: bool | None = True) -> Detection:
    return Detection(slip, score, threshold, 0.6, score if score <= 1 else math.nan)


def test_an_alarm_counts_once_however_long_it_lasts():
    evidence = SlipEvidence(0.105)
    added = [evidence.take(detection(0.95), SLOW, 1.0).lasting for _ in range(20)]
    assert max(added) <= MOST_EVIDENCE
    assert sum(added) > MOST_EVIDENCE
    assert added[5:] == [0.0] * 15
    ended = [evidence.take(detection(0.0, slip=False), REST, 1.0).lasting for _ in range(20)]
    fresh = SlipEvidence(0.105)
    silent = [fresh.take(detection(0.0, slip=False), REST, 1.0).lasting for _ in range(20)]
    assert sum(added) + sum(ended) == pytest.approx(sum(silent))
    assert sum(silent) < 0


def test_of_a_slide_that_has_just_begun_silence_counts_in_full_and_a_lasting_alarm_not_at_all():
    silent, alarmed = SlipEvidence(0.105), SlipEvidence(0.105)
    silence = [silent.take(detection(0.02, slip=False), REST, 1.0) for _ in range(6)]
    assert silence[-1].lasting == 0
    assert silence[-1].begun == silence[0].begun == silence[0].lasting < -1
    alarm = [alarmed.take(detection(0.95), SLOW, 1.0) for _ in range(6)]
    assert alarm[0].begun == MOST_EVIDENCE
    assert alarm[-1].begun == 0


def test_a_detector_that_is_silent_speaks_against_each_slide_that_may_have_begun():
    """After a silence at rest, that of the first loaded frames said nothing, and half of the grips closed for it."""
    waited, began = GripBelief(OPTIONS, 0.105), GripBelief(OPTIONS, 0.105)
    silences = {}
    for belief, rests in ((waited, 30), (began, 0)):
        evidence = SlipEvidence(0.105)
        for _ in range(rests):
            belief.weigh(evidence.take(detection(0.02, slip=False), REST, 1.0), 1.2, FRAME_S, True)
        for load_n in (0.3, 0.4):
            belief.update(load_n, 1.2, FRAME_S, evidence.take(detection(0.02, slip=False), REST, 1.0))
        silences[rests] = belief.slips
    assert silences[30] == pytest.approx(silences[0], rel=0.5)
    assert silences[30] < 0.2


def test_an_alarm_that_lasts_is_no_evidence_against_a_slide_when_the_squeeze_changes():
    evidence = SlipEvidence(0.105)
    evidence.take(detection(0.95), SLOW, 1.0)
    assert evidence.take(detection(0.95), SLOW, 0.0).lasting >= 0


def test_a_speed_speaks_for_a_slide_that_the_detector_does_not_see():
    silent = detection(0.05, slip=False)
    at_rest, moves = (SlipEvidence(0.105).take(silent, estimate, 1.0) for estimate in (REST, SLOW))
    assert at_rest < moves


def test_an_abstention_is_no_evidence():
    assert SlipEvidence(0.105).take(detection(math.nan, slip=None), SLOW, 1.0) == both(0.0)


def test_a_silent_detector_speaks_against_a_slide_only_as_far_as_it_sees_slides():
    silent, blind = GripBelief(OPTIONS, 0.105), GripBelief(OPTIONS, 0.105)
    for _ in range(30):
        silent.update(1.0, 1.5, FRAME_S, both(-4.0))
        blind.update(1.0, 1.5, FRAME_S, both(0.0))
    assert blind.slips > silent.slips > 0.5 * OPTIONS.unseen * blind.slips


def test_while_nothing_is_loaded_at_rest_nothing_slides():
    belief = GripBelief(OPTIONS, 0.105)
    for _ in range(50):
        belief.update(0.03, 1.2, FRAME_S, both(0.0), True, 0.0, faint=True)
    assert belief.slips < 0.01
    limit_n, std_n = belief.limit_n(1.2)
    assert limit_n == pytest.approx(OPTIONS.limit * 1.2**OPTIONS.power, rel=0.25)
    assert std_n / limit_n == pytest.approx(OPTIONS.spread, rel=0.2)


@pytest.mark.parametrize(("moved_mm", "credible"), [(0.4, True), (0.0, False)])
def test_alarms_are_credible_if_an_arm_that_moves_loads_nothing(moved_mm, credible):
    belief = GripBelief(OPTIONS, 0.105)
    for _ in range(10):
        belief.update(0.03, 1.2, FRAME_S, both(0.0), True, 0.0, faint=True)
    for evidence in (-1.0, 4.0, 3.0, 0.0):
        belief.update(0.03, 1.2, FRAME_S, both(evidence), moved_mm=moved_mm, faint=True)
    assert (belief.slips > 0.5) is credible
    assert credible or belief.slips < 0.1


def test_a_slide_that_stays_within_the_noise_at_a_firm_squeeze_is_hardly_possible():
    belief = GripBelief(OPTIONS, 0.105)
    for squeeze_mm in (1.0, 1.5, 2.2, 3.3, 5.0):
        for _ in range(6):
            belief.update(0.03, squeeze_mm, FRAME_S, both(0.5), moved_mm=0.4, faint=True)
    assert belief.slips < 0.5


def test_a_fast_slide_needs_more_grip_to_stop():
    belief = GripBelief(OPTIONS, 0.105)
    sliding(belief, 1.5)
    resting, braking = (belief.squeeze_mm(0.25, 1.2, 1.0, factor) for factor in (1.0, 2.0))
    assert braking > 1.3 * resting


@pytest.mark.parametrize(("slip", "expected"), [(True, 0.8), (False, 0.2)])
def test_a_score_that_is_no_probability_counts_by_its_decision(slip, expected):
    assert probability(detection(7.0, threshold=3.0, slip=slip)) == pytest.approx(expected)


@settings(max_examples=40)
@given(
    frames=st.lists(
        st.tuples(
            *(st.floats(0, 60), st.floats(0.3, 20), st.floats(0, 0.2)),
            st.builds(Evidence, st.floats(-9, 9), st.floats(-9, 9)),
            st.booleans(),
            st.sampled_from([0.0, 0.5, math.inf]),
        ),
        min_size=1,
        max_size=25,
    )
)
def test_the_compiled_belief_is_the_same(frames):
    pytest.importorskip("numba")
    portable, fast = (GripBelief(OPTIONS, 0.105, compiled=kind) for kind in (False, True))
    for count, (load_n, squeeze_mm, dt_s, evidence, stands, moved_mm) in enumerate(frames):
        for belief in (portable, fast):
            if count % 3 == 1:
                belief.weigh(evidence, squeeze_mm if stands else math.nan, dt_s)
            elif count == 5:
                belief.know_normal(load_n + 0.1, squeeze_mm)
            belief.update(load_n, squeeze_mm, dt_s, evidence, stands, moved_mm, faint=count % 4 == 2)
        assert fast.stick == pytest.approx(portable.stick, rel=1e-6, abs=1e-12)
        assert fast.slide == pytest.approx(portable.slide, rel=1e-6, abs=1e-12)
        needs = [belief.squeeze_mm(0.25, 1.2, max(load_n, 0.03), 1.1) for belief in (portable, fast)]
        assert needs[1] == pytest.approx(needs[0], rel=1e-6)
        for risk in (0.01, 0.05, 0.35, 0.9):
            assert fast.squeeze_mm(risk, 1.0, 25.0) == pytest.approx(portable.squeeze_mm(risk, 1.0, 25.0), rel=1e-6)
        assert fast.limit_n(squeeze_mm) == pytest.approx(portable.limit_n(squeeze_mm), rel=1e-6)
        assert fast.slips == pytest.approx(portable.slips, rel=1e-6, abs=1e-12)
        assert fast.limit_n(squeeze_mm) == pytest.approx(portable.limit_n(squeeze_mm), rel=1e-6)


def test_a_round_without_a_load_ends_a_slide_that_the_squeeze_stops_and_no_other():
    slides = []
    for squeeze_mm in (1.5, 4.0):
        belief = GripBelief(OPTIONS, 0.105)
        sliding(belief, 1.5)
        for _ in range(6):
            belief.weigh(both(0.0), squeeze_mm, FRAME_S)
        slides.append(belief.slips)
    # A heavier object goes on sliding: its weight is unknown while it slides.
    assert slides[0] > 0.75 > 0.6 > slides[1]


def test_without_any_load_an_alarm_stays_an_alarm():
    belief = GripBelief(OPTIONS, 0.105)
    for evidence in (4.0, 2.0, 0.0, 0.0, 0.0):
        belief.weigh(both(evidence), 2.0, FRAME_S)
    assert belief.slips > 0.75
    assert belief.stick.sum() + belief.slide.sum() == pytest.approx(1.0)


def test_the_greatest_load_fades_whether_or_not_a_load_is_measured():
    fades = []
    for measured in (True, False):
        belief = GripBelief(OPTIONS, 0.105)
        belief.update(1.0, 2.0, FRAME_S, both(0.0))
        before = belief._greatest
        for _ in range(50):
            if measured:
                belief.update(0.01, 2.0, FRAME_S, both(0.0))
            else:
                belief.weigh(both(0.0), 2.0, FRAME_S)
        fades.append(belief._greatest - before)
    assert fades[1] == pytest.approx(fades[0]) == pytest.approx(-50 * FRAME_S / FORGET_S)


def test_a_surface_that_gets_wet_keeps_half_of_its_friction():
    """Half of the jumps are those of friction, the others of the load."""
    belief = GripBelief(GripOptions(jumps_hz=1.0), 0.105)
    belief.know_normal(4.0, 2.0)
    dry_n, _ = belief.limit_n(2.0)
    for _ in range(500):
        belief.weigh(both(0.0), math.nan, FRAME_S)
    assert belief.limit_n(2.0)[0] == pytest.approx(math.sqrt(WET_SHARE) * dry_n, rel=0.1)


def test_a_load_that_rose_while_it_was_not_measured_rose_slowly():
    """The rise counts over the time since the last load, not over one round."""
    heavier = []
    for rounds in (0, 20):
        belief = GripBelief(OPTIONS, 0.105)
        belief.update(1.0, 4.0, FRAME_S, both(0.0))
        for _ in range(rounds):
            belief.weigh(both(0.0), 4.0, FRAME_S)
        belief.update(1.1, 4.0, FRAME_S, both(0.0))
        heavier.append(float(belief.stick[belief.load_n > 1.6].sum()))
    assert heavier[1] < 0.5 * heavier[0]


@given(before_mm=st.floats(0.8, 4), now_mm=st.floats(0.8, 4))
def test_a_corrected_touch_keeps_the_limit(before_mm, now_mm):
    belief = GripBelief(OPTIONS, 0.105)
    for count in range(12):
        belief.update(0.1 * count, before_mm, FRAME_S, both(-1.0))
    (limit_n, _), slips = belief.limit_n(before_mm), belief.slips
    needed_mm = belief.squeeze_mm(0.2, 1.2, 1.0)
    belief.rescale(before_mm, now_mm)
    assert belief.stick.sum() + belief.slide.sum() == pytest.approx(1.0)
    assert belief.slips == pytest.approx(slips)
    assert belief.limit_n(now_mm)[0] == pytest.approx(limit_n, rel=0.1)
    assert belief.squeeze_mm(0.2, 1.2, 1.0) == pytest.approx(needed_mm * now_mm / before_mm, rel=0.1)


def test_a_doubted_normal_force_leaves_no_trace():
    plain, doubting = (GripBelief(OPTIONS, 0.105) for _ in range(2))
    doubting.know_normal(0.17, 1.2)
    doubting.rescale(1.2, 1.0)
    plain.rescale(1.2, 1.0)
    doubting.doubt_normal()
    assert doubting.limit_n(1.0) == pytest.approx(plain.limit_n(1.0), rel=0.1)
    for belief in (plain, doubting):
        belief.update(1.9, 1.0, FRAME_S, both(-1.0))
    assert doubting.limit_n(1.0)[0] == pytest.approx(plain.limit_n(1.0)[0], rel=0.1)
    doubting.doubt_normal()


@pytest.mark.parametrize("now_mm", [0.4, 2.5])
def test_a_normal_force_counts_alike_before_and_after_a_corrected_touch(now_mm):
    first, later = (GripBelief(OPTIONS, 0.105) for _ in range(2))
    first.know_normal(4.0, 1.0)
    first.rescale(1.0, now_mm)
    later.rescale(1.0, now_mm)
    later.know_normal(4.0, now_mm)
    assert later.limit_n(now_mm) == pytest.approx(first.limit_n(now_mm), rel=0.1)
    assert later._prior_r == pytest.approx(first._prior_r, abs=0.01)


def test_a_load_that_was_carried_before_a_corrected_touch_breaks_nothing_away_after_it():
    slips = []
    for now_mm in (2.0, 1.0):
        belief = GripBelief(OPTIONS, 0.105)
        for _ in range(10):
            belief.update(1.0, 2.0, FRAME_S, both(-1.0))
        belief.rescale(2.0, now_mm)
        belief.update(1.0, now_mm, FRAME_S, both(0.0))
        slips.append(belief.slips)
    assert slips[1] == pytest.approx(slips[0], abs=0.003)


def test_a_silent_detector_is_no_evidence_for_a_slide_after_an_abstention_while_the_fingers_close():
    evidence = SlipEvidence(0.105)
    silent, abstains = detection(0.02, slip=False), detection(math.nan, slip=None)
    for seen, since_change_s in ((silent, 0.01), (silent, 0.02), (abstains, 0.04), (silent, 0.08)):
        last = evidence.take(seen, REST, since_change_s)
    assert last.lasting < 0.1


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("gap_s", [1.0, 20.0, 1e4])
def test_after_a_long_gap_it_is_still_a_probability(gap_s, compiled):
    if compiled:
        pytest.importorskip("numba")
    belief = GripBelief(OPTIONS, 0.105, compiled=compiled)
    belief.update(1.0, 2.0, FRAME_S, both(0.0))
    belief.weigh(both(0.0), 2.0, gap_s)
    belief.update(1.0, 2.0, gap_s, both(0.0))
    assert 0 <= belief.slips <= 1
    assert min(belief.stick.min(), belief.slide.min()) >= 0
    assert belief.stick.sum() + belief.slide.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("drift", [0.05, 0.1, 0.3, 1.0])
def test_the_load_drifts_by_its_option(drift, compiled):
    if compiled:
        pytest.importorskip("numba")
    belief = GripBelief(GripOptions(drift=drift), 0.105, compiled=compiled)
    belief.stick[:], belief.slide[:] = 0.0, 0.0
    belief.stick[len(belief.load_n) // 2, 40] = 1.0
    belief._walk(0.12, changed=False)
    by_w, ln_w = belief.stick.sum(axis=1), np.log(belief.load_n)
    variance = by_w @ ln_w**2 - (by_w @ ln_w) ** 2
    assert math.sqrt(variance) == pytest.approx(drift * math.sqrt(0.12), rel=1e-6)


@pytest.mark.parametrize("compiled", [False, True])
def test_the_faster_a_slide_the_more_squeeze_stops_it(compiled):
    """The load of a fast slide may be greater than any on the grid."""
    if compiled:
        pytest.importorskip("numba")
    belief = GripBelief(OPTIONS, 0.105, compiled=compiled)
    sliding(belief, 1.5)
    needed = [belief.squeeze_mm(0.1, 1.1, 1.0, braking) for braking in (1.0, 10.0, 1e3, 1e6, 1e12)]
    assert needed == sorted(needed)
    assert needed[0] > 1.5


@pytest.mark.parametrize(("squeeze_mm", "power"), [(0.8, 1.4), (3.0, 1.4), (3.0, 1.0)])
def test_another_power_keeps_the_limit_of_now_and_changes_how_it_grows(squeeze_mm, power):
    belief = GripBelief(OPTIONS, 0.105)
    sliding(belief, squeeze_mm)
    before_n, _ = belief.limit_n(squeeze_mm)
    doubled_n, _ = belief.limit_n(2 * squeeze_mm)
    belief.know_power(power, squeeze_mm)
    assert belief.limit_n(squeeze_mm)[0] == pytest.approx(before_n, rel=1e-3)
    assert belief.limit_n(2 * squeeze_mm)[0] == pytest.approx(doubled_n * 2 ** (power - OPTIONS.power), rel=1e-3)
    assert belief.slips == pytest.approx(belief.slide.sum())
    belief.reset()
    assert belief.power == OPTIONS.power
