"""The budget of a frame: what it leaves out, when, and that it is kept in the mean."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.contracts import Detection
from lsds.runtime.frame_budget import (
    AVERAGED_FRAMES,
    IN_FULL_MS,
    MARKERS_MS,
    MOST_LEFT_OUT,
    MOVES_PX,
    FrameBudget,
    may_move,
)

PX_M = 6e-5
STILL = Detection(False, 0.1, 0.5, 0.8)
FRAMES = st.lists(st.booleans(), min_size=1, max_size=400)


def seen_in_full(budget: FrameBudget, frames: list[bool]) -> list[bool]:
    return [budget.affords(moves=moves) for moves in frames]


@given(FRAMES, st.floats(MARKERS_MS + IN_FULL_MS + 1e-6, 50))
def test_a_budget_for_everything_leaves_nothing_out(frames, budget_ms):
    assert all(seen_in_full(FrameBudget(budget_ms), frames))


@given(FRAMES, st.floats(0.01, 5))
def test_no_budget_leaves_out_many_frames_in_a_row(frames, budget_ms):
    row = "".join("x" if full else "." for full in seen_in_full(FrameBudget(budget_ms), frames))
    assert row[0] == "x"
    assert "." * (MOST_LEFT_OUT + 1) not in row
    assert all(full == "x" for full, moves in zip(row, frames, strict=True) if moves)


@given(st.integers(1, 400), st.floats(MARKERS_MS + IN_FULL_MS / (MOST_LEFT_OUT + 1), 5))
def test_the_mean_time_of_frames_at_rest_stays_within_the_budget_but_for_the_first_credit(count, budget_ms):
    full = seen_in_full(FrameBudget(budget_ms), [False] * count)
    spent_ms = count * MARKERS_MS + sum(full) * IN_FULL_MS
    credit_ms = AVERAGED_FRAMES * (budget_ms - MARKERS_MS)
    # A frame that has to be seen after several that were not may be on credit.
    assert spent_ms <= count * budget_ms + credit_ms + IN_FULL_MS or budget_ms > MARKERS_MS + IN_FULL_MS


def test_frames_at_rest_leave_credit_for_frames_that_move():
    rest = seen_in_full(FrameBudget(1.2), [False] * 300)
    after = FrameBudget(1.2)
    seen_in_full(after, [True] * 100)
    assert np.mean(rest[100:]) == pytest.approx((1.2 - MARKERS_MS) / IN_FULL_MS, abs=0.02)
    # Frames that moved have used the credit; the frames at rest that follow restore it.
    assert sum(seen_in_full(after, [False] * 50)) == 50 // (MOST_LEFT_OUT + 1)


@given(FRAMES, st.floats(0.5, 3), st.sampled_from([0.5, 2.0]))
def test_a_slower_machine_has_less_time(frames, budget_ms, scale):
    assert seen_in_full(FrameBudget(budget_ms * scale, scale), frames) == seen_in_full(FrameBudget(budget_ms), frames)


def moved(moved_px: float, dt_s: float = 0.04, known: int = 20):
    velocity = np.full((20, 2), np.nan)
    velocity[:known] = np.array([0.6, 0.8]) * moved_px * PX_M / dt_s
    return SimpleNamespace(dt_s=dt_s, velocity_m_s=velocity)


@pytest.mark.parametrize(
    ("field", "last", "expected"),
    [
        (moved(0.5 * MOVES_PX), STILL, False),
        (moved(2 * MOVES_PX), STILL, True),
        (moved(0.5 * MOVES_PX, known=3), STILL, False),
        (moved(0.0, known=0), STILL, True),
        (moved(0.0, dt_s=math.nan), STILL, True),
        (moved(0.0), None, True),
        (moved(0.0), Detection(None, math.nan, 0.5, math.nan), True),
        (moved(0.0), Detection(True, 0.9, 0.5, 0.8), True),
        (moved(0.0), Detection(False, 0.4, 0.5, 0.2), True),
        (moved(0.0), Detection(False, 0.4, 0.5, math.nan), True),
    ],
)
def test_a_frame_may_show_motion_if_the_markers_move_or_the_last_answer_is_not_sure(field, last, expected):
    assert may_move(field, last, PX_M) is expected
