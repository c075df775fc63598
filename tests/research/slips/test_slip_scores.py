"""Scores frame by frame and slip by slip, and how far two labellers agree."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_research.slips.agreement import agreement
from lsds_research.slips.labels import Interval, State, states
from lsds_research.slips.score import (
    EARLY,
    FIRST_FRAMES,
    LATE,
    Counts,
    LabelledOutputs,
    counted,
    onset_errors,
    scored_frames,
    scored_intervals,
    travels,
)


def labelled(*parts):
    """Intervals of (frames, state, confidence), one after another."""
    found, begin = [], 0
    for length, state, sure in parts:
        found.append(Interval(begin, begin + length - 1, state, confidence=sure))
        begin += length
    return found


parts = st.lists(
    st.tuples(st.integers(1, 15), st.sampled_from(State), st.sampled_from((0.3, 0.5, 0.7, 0.9))), min_size=1, max_size=8
)
recordings = parts.map(lambda drawn: labelled(*drawn))
SLIDE = labelled((12, State.STICK, 0.9), (8, State.SLIP, 0.9), (10, State.STICK, 0.9))


def outputs(intervals, alarms=(), count=None, moved=1.0, slid=None, turned=None, abstains=()):
    count = count or intervals[-1].last + 1
    slip = np.zeros(count)
    slip[list(alarms)] = 1
    slip[list(abstains)] = np.nan
    nothing = np.full(count, np.nan)
    slid = np.full((count, 2), np.nan) if slid is None else slid
    return LabelledOutputs(intervals, slip, np.full(count, moved), slid, nothing if turned is None else turned)


# -- frames ------------------------------------------------------------------------------------------------


@given(recordings, st.integers(1, 80), st.integers(0, 10_000))
def test_a_frame_is_scored_at_most_once_and_only_where_its_label_is_sure(own, count, seed):
    moved = np.random.default_rng(seed).uniform(0, 1, count)
    frames = scored_frames(own, moved)
    state, sure = states(own, count)
    every = np.stack([frames.slip, frames.moving, frames.still])
    assert every.shape == (3, count)
    assert (every.sum(axis=0) <= 1).all()
    assert not every[:, :FIRST_FRAMES].any()
    assert (sure[every.any(axis=0)] >= 0.5).all()
    assert (state[frames.slip] == State.SLIP).all()
    for quiet in (frames.moving, frames.still):
        assert np.isin(state[quiet], (State.FREE, State.STICK)).all()
        for beside in (-1, 1):
            at = np.flatnonzero(quiet) + beside
            at = at[(at >= 0) & (at < count)]
            assert np.isin(state[at], (State.FREE, State.STICK)).all(), "an onset is known to a frame"
    assert (moved[frames.moving] > 0.5).all()
    assert (moved[frames.still] <= 0.5).all()


def test_the_frames_of_a_slide():
    frames = scored_frames(SLIDE, np.where(np.arange(30) < 25, 1.0, 0.0))
    assert np.flatnonzero(frames.slip).tolist() == list(range(12, 20))
    assert np.flatnonzero(frames.moving).tolist() == [9, 10, *range(21, 25)]
    assert np.flatnonzero(frames.still).tolist() == list(range(25, 30))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_recording_of_a_frame_or_two_has_nothing_to_score(count):
    own = [Interval(0, count - 1, State.SLIP)]
    assert counted(outputs(own)) == Counts()


# -- counts ------------------------------------------------------------------------------------------------


@given(recordings, st.integers(0, 10_000))
def test_counts_add_up_and_no_part_is_more_than_its_whole(own, seed):
    rng = np.random.default_rng(seed)
    slip = rng.choice([0.0, 1.0, np.nan], own[-1].last + 1)
    drawn = dataclasses.replace(outputs(own), slip=slip, moved_px=rng.uniform(0, 1, len(slip)))
    counts = counted(drawn)
    assert counts.found <= counts.slip
    assert counts.false_moving <= counts.moving
    assert counts.false_still <= counts.still
    assert counts.noticed <= counts.intervals == len(scored_intervals(own))
    assert counts.answered <= counts.frames == counts.slip + counts.moving + counts.still
    assert counts + Counts() == counts
    twice = counts + counts
    assert all(getattr(twice, name) == 2 * getattr(counts, name) for name in Counts.__slots__)
    for share in (counts.recall, counts.noticed_share):
        assert math.isnan(share) or 0 <= share <= 1


@given(recordings)
def test_saying_what_is_labelled_is_perfect_and_saying_nothing_is_no_alarm(own):
    state, _ = states(own, own[-1].last + 1)
    perfect = counted(outputs(own, np.flatnonzero(state == State.SLIP)))
    assert perfect.found == perfect.slip
    assert perfect.noticed == perfect.intervals
    assert perfect.false_moving == perfect.false_still == 0
    mute = counted(outputs(own, abstains=range(len(state))))
    # Not one of the frames without an answer is still.
    assert (mute.found, mute.noticed, mute.answered, mute.still) == (0, 0, 0, 0)
    assert (mute.false_moving, mute.false_still) == (0, 0)
    assert mute.slip_unanswered == mute.slip == perfect.slip
    assert mute.moving_unanswered == mute.moving >= perfect.moving


def test_nothing_scored_has_no_share():
    none = Counts()
    assert all(
        math.isnan(share) for share in (none.recall, none.noticed_share, none.per_100_moving, none.per_100_still)
    )
    some = Counts(slip=4, found=1, moving=50, false_moving=2, still=200, false_still=1, intervals=2, noticed=1)
    assert (some.recall, some.noticed_share) == (0.25, 0.5)
    assert (some.per_100_moving, some.per_100_still) == (4.0, 0.5)


@pytest.mark.parametrize(
    ("alarms", "late"),
    [
        ([10], math.nan),
        ([11], -EARLY),
        ([12], 0),
        ([14], LATE),
        ([15], math.nan),
        ([11, 12, 14], -EARLY),
        ([], math.nan),
    ],
)
def test_a_slip_is_noticed_from_a_frame_before_to_two_after_its_onset(alarms, late):
    assert onset_errors(outputs(SLIDE, alarms)).tolist() == pytest.approx([late], nan_ok=True)


def test_a_short_slip_is_not_noticed_after_its_end():
    short = labelled((12, State.STICK, 0.9), (1, State.SLIP, 0.9), (10, State.STICK, 0.9))
    assert onset_errors(outputs(short, [12])).tolist() == [0]
    assert np.isnan(onset_errors(outputs(short, [13, 14]))).all()


def test_a_slip_that_is_unsure_or_at_the_very_start_is_not_scored():
    unsure = labelled((12, State.STICK, 0.9), (8, State.SLIP, 0.3), (10, State.STICK, 0.9))
    early = labelled((5, State.STICK, 0.9), (8, State.SLIP, 0.9), (10, State.STICK, 0.9))
    for own in (unsure, early):
        assert scored_intervals(own) == []
        assert onset_errors(outputs(own, [5, 12])).size == 0
    assert scored_intervals(SLIDE) == [SLIDE[1]]


# -- travel ------------------------------------------------------------------------------------------------


def travelled(tx, ty, turn, step=(1.0, -0.5), turned=0.25, unknown=()):
    own = [SLIDE[0], Interval(12, 19, State.SLIP, tx, ty, turn), SLIDE[2]]
    slid, turns = np.tile(step, (30, 1)), np.full(30, turned)
    slid[list(unknown)] = np.nan
    turns[list(unknown)] = np.nan
    (error,) = travels(outputs(own, slid=slid, turned=turns))
    return error


def test_travel_and_turn_are_summed_over_the_slip():
    assert travelled(8.0, -4.0, 2.0).off_px == pytest.approx(0)
    error = travelled(8.0 + 3.0, -4.0 + 4.0, 5.0)
    assert (error.off_px, error.labelled_px, error.off_deg, error.labelled_deg) == pytest.approx((5, 11, -3, 5))


def test_of_a_direction_that_is_not_labelled_nothing_is_off():
    error = travelled(10.0, math.nan, math.nan)
    assert (error.labelled_px, error.off_px) == pytest.approx((10, 2))
    assert math.isnan(error.off_deg)
    nothing = travelled(math.nan, math.nan, 1.0)
    assert math.isnan(nothing.off_px)
    assert math.isnan(nothing.labelled_px)
    assert nothing.off_deg == pytest.approx(1.0)


def test_frames_without_an_estimate_count_as_no_travel_and_none_at_all_as_unknown():
    assert travelled(8.0, -4.0, 2.0, unknown=[13, 14]).off_px == pytest.approx(math.hypot(2, 1))
    none = travelled(8.0, -4.0, 2.0, unknown=range(30))
    assert math.isnan(none.off_px)
    assert math.isnan(none.off_deg)


# -- agreement ---------------------------------------------------------------------------------------------


@given(st.dictionaries(st.sampled_from("abc"), recordings, max_size=3))
def test_labels_agree_with_themselves(own):
    found = agreement(own, own)
    assert found.videos == len(own)
    assert found.both == found.intervals == sum(len(scored_intervals(each)) for each in own.values())
    assert found.same == pytest.approx(1.0 if found.frames else math.nan, nan_ok=True)
    assert math.isnan(found.kappa) or found.kappa == pytest.approx(1.0)


@given(recordings, recordings)
def test_agreement_is_within_its_bounds_and_no_matter_who_comes_first(one, other):
    found, turned = agreement({"a": one}, {"a": other}), agreement({"a": other}, {"a": one})
    assert (found.videos, found.frames) == (turned.videos, turned.frames)
    assert found.same == pytest.approx(turned.same, nan_ok=True)
    assert found.kappa == pytest.approx(turned.kappa, nan_ok=True)
    assert 0 <= found.both <= found.intervals
    assert math.isnan(found.same) or 0 <= found.same <= 1
    assert math.isnan(found.kappa) or -1 <= found.kappa <= found.same + 1e-9


def test_kappa_is_that_of_cohens_table():
    # Of 20 frames both say slip of 4, one alone of 2 and 2.
    one = labelled((10, State.STICK, 0.9), (6, State.SLIP, 0.9), (4, State.STICK, 0.9))
    other = labelled((12, State.STICK, 0.9), (6, State.SLIP, 0.9), (2, State.FREE, 0.9))
    found = agreement({"a": one, "b": one}, {"a": other, "c": one})
    assert (found.videos, found.frames, found.intervals, found.both) == (1, 20, 1, 1)
    assert found.same == pytest.approx(16 / 20)
    chance = (6 / 20) ** 2 + (14 / 20) ** 2
    assert found.kappa == pytest.approx((16 / 20 - chance) / (1 - chance))


def test_what_either_is_unsure_of_is_left_out():
    one = labelled((10, State.STICK, 0.9), (6, State.SLIP, 0.9), (4, State.TOUCH, 0.9))
    other = labelled((8, State.STICK, 0.3), (8, State.SLIP, 0.9), (2, State.UNSURE, 0.9), (2, State.FREE, 0.9))
    assert agreement({"a": one}, {"a": other}).frames == 8


def test_slips_that_only_one_names_are_counted_and_those_that_meet_are_one():
    def slips(*firsts):
        cut = [Interval(first, first + 3, State.SLIP) for first in firsts]
        return [*cut, Interval(firsts[-1] + 4, 99, State.STICK)]

    # Three frames apart is what two onsets are known to, four are not.
    found = agreement({"a": slips(20, 40, 60)}, {"a": slips(26, 41, 80)})
    assert (found.both, found.intervals) == (2, 4)
    assert agreement({"a": slips(20)}, {"a": slips(28)}).both == 0


def test_nothing_in_common_is_no_agreement():
    found = agreement({"a": SLIDE}, {"b": SLIDE})
    assert (found.videos, found.frames, found.intervals, found.both) == (0, 0, 0, 0)
    assert math.isnan(found.same)
    assert math.isnan(found.kappa)
