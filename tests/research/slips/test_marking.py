"""Marking states between two frames: whatever keys are pressed, each frame has exactly one state."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from lsds_research.slips.labels import Interval, State, states
from lsds_research.slips.marking import KEYS, Marking

MOVE, MARK, UNDO = "move", "mark", "undo"
presses = st.lists(
    st.one_of(
        st.tuples(st.just(MOVE), st.integers(-50, 50)),
        st.just((MARK, 0)),
        st.just((UNDO, 0)),
        st.tuples(st.sampled_from(State), st.just(0)),
    ),
    max_size=30,
)
lengths = st.lists(st.tuples(st.integers(1, 20), st.sampled_from(State)), max_size=5)


def labelled(parts):
    """Intervals of so many frames and those states, one after another."""
    found, begin = [], 0
    for length, state in parts:
        found.append(Interval(begin, begin + length - 1, state, confidence=0.7, labeller="A"))
        begin += length
    return found


def covers(marking, count):
    own = marking.intervals
    assert own[0].first == 0
    assert own[-1].last == count - 1
    assert all(one.last + 1 == other.first for one, other in pairwise(own))
    assert all(each.first <= each.last for each in own)


@given(st.integers(1, 60), lengths, presses)
def test_whatever_is_pressed_each_frame_has_one_state_the_last_one_set(count, before, pressed):
    intervals = labelled(before)
    marking = Marking(count, intervals, "B")
    covers(marking, count)
    # The same by hand: an array of states, and of all earlier ones.
    expected = states(intervals, count)[0]
    undone: list[np.ndarray] = []
    cursor, mark = 0, None
    for press, by in pressed:
        if press == MOVE:
            marking.move(by)
            cursor = int(np.clip(cursor + by, 0, count - 1))
        elif press == MARK:
            marking.mark = mark = marking.cursor
        elif press == UNDO:
            marking.undo()
            expected = undone.pop() if undone else expected
        else:
            marking.set(press)
            undone.append(expected.copy())
            first, last = sorted((cursor, cursor if mark is None else mark))
            expected[first : last + 1] = press
            mark = None
        covers(marking, count)
        assert (marking.cursor, marking.mark) == (cursor, mark)
        assert states(marking.intervals, count)[0].tolist() == expected.tolist()
        assert marking.at(cursor).state == expected[cursor]


@given(st.integers(1, 40), lengths)
def test_all_taken_back_is_what_it_was(count, before):
    marking = Marking(count, labelled(before))
    was = marking.intervals
    for state in State:
        marking.move(3)
        marking.set(state)
    for _ in State:
        marking.undo()
    assert marking.intervals == was


def test_unlabelled_frames_are_unsure_without_confidence_and_set_frames_have_a_labeller():
    marking = Marking(20, labelled([(5, State.STICK)]), "B")
    assert (marking.at(5).state, marking.at(5).confidence, marking.at(19).last) == (State.UNSURE, 0.0, 19)
    marking.move(7)
    marking.mark = 7
    marking.move(2)
    assert marking.chosen == (7, 9)
    marking.set(State.SLIP)
    own = marking.at(8)
    assert (own.first, own.last, own.confidence, own.labeller) == (7, 9, 1.0, "B")
    assert marking.at(0).labeller == "A"
    assert marking.chosen == (9, 9), "the mark is gone"


def test_neighbours_that_say_the_same_become_one():
    marking = Marking(10, labelled([(10, State.FREE)]), "B")
    for _ in range(4):
        marking.set(State.STICK)
        marking.move(1)
    assert [(each.first, each.last) for each in marking.intervals] == [(0, 3), (4, 9)]


def test_what_is_unknown_of_two_neighbours_is_alike_wherever_it_comes_from():
    # Python 3.13 compares fields one by one, so that no NaN equals another, not even itself.
    unknown = [Interval(first, first + 4, State.STICK, *(float("nan") for _ in range(3))) for first in (0, 5)]
    marking = Marking(11, [*unknown, Interval(10, 10, State.FREE)])
    marking.move(10)
    marking.set(State.FREE)
    assert [(each.first, each.last) for each in marking.intervals] == [(0, 9), (10, 10)]


def test_two_slips_that_travel_alike_stay_two():
    slips = [Interval(first, first + 4, State.SLIP, 3.0, 0.0, math.nan) for first in (0, 5)]
    marking = Marking(11, slips)
    marking.move(10)
    marking.set(State.FREE)
    assert [(each.first, each.last, each.tx_px) for each in marking.intervals[:2]] == [(0, 4, 3.0), (5, 9, 3.0)]


def test_labels_of_a_longer_recording_are_cut():
    marking = Marking(7, labelled([(5, State.STICK), (5, State.SLIP), (5, State.FREE)]))
    assert [(each.first, each.last, each.state) for each in marking.intervals] == [
        (0, 4, State.STICK),
        (5, 6, State.SLIP),
    ]


def test_there_is_a_key_for_every_state():
    assert sorted(KEYS.values()) == sorted(State)
