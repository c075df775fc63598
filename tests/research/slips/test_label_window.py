"""The window to label in, driven by made-up key presses."""

from __future__ import annotations

from types import SimpleNamespace

import matplotlib.pyplot as plt
import pytest
from lsds_research.slips.labels import Interval, State
from lsds_research.slips.marking import Marking
from lsds_research.slips.pictures import IN_A_ROW
from lsds_research.slips.window import LabelWindow
from matplotlib import rc_context
from research.slips.slid import COUNT, SLIDE

MOTIONS = [(4, 7), (12, 14), (20, 25)]


@pytest.fixture
def window(seen, monkeypatch):
    """A window without a screen on a recording with three motions, its marking, and what was saved."""
    monkeypatch.setattr(seen[SLIDE], "moving", lambda: MOTIONS)
    backend = plt.get_backend()
    plt.switch_backend("agg")
    marking, saved = Marking(COUNT, [Interval(0, 4, State.FREE)], "B"), []
    with rc_context():
        made = LabelWindow(seen[SLIDE], marking, lambda now: saved.append(list(now.intervals)))
        # Without a screen every key would draw at once.
        made.figure.canvas.draw_idle = lambda: None
        yield SimpleNamespace(press=lambda *keys: pressed(made, keys), marking=marking, saved=saved, made=made)
    plt.close(made.figure)
    plt.switch_backend(backend)


def pressed(window, keys):
    for key in keys:
        window.press(SimpleNamespace(key=key))


def test_keys_move_the_cursor_by_frames_and_rows_and_stop_at_the_ends(window):
    window.press("right", "right", "left")
    assert window.marking.cursor == 1
    window.press("down")
    assert window.marking.cursor == 1 + IN_A_ROW
    window.press("up", "up", "left")
    assert window.marking.cursor == 0
    window.press(*["down"] * 4)
    assert window.marking.cursor == COUNT - 1
    assert window.saved == [], "looking changes nothing"


def test_keys_jump_to_the_next_motion_and_back(window):
    def after(*keys):
        window.press(*keys)
        return window.marking.cursor

    assert [after("n") for _ in range(4)] == [4, 12, 20, 20], "after the last range the cursor stays"
    assert after("right", "p") == 20
    assert [after("p") for _ in range(3)] == [12, 4, 4]
    assert after("left", "p") == 3, "nor before the first"


def test_a_state_is_set_from_the_mark_to_the_cursor_and_saved_at_once_and_taken_back(window):
    window.press("right", "m", "down", "s")
    assert [(each.first, each.last, each.state) for each in window.saved[-1]] == [
        (0, 0, State.FREE),
        (1, 9, State.SLIP),
        (10, COUNT - 1, State.UNSURE),
    ]
    assert window.saved[-1][1].labeller == "B"
    window.press("z")
    assert len(window.saved) == 2
    assert [each.last for each in window.saved[-1]] == [4, COUNT - 1]


@pytest.mark.parametrize(
    ("key", "state"),
    [("f", State.FREE), ("k", State.STICK), ("s", State.SLIP), ("t", State.TOUCH), ("u", State.UNSURE)],
)
def test_each_state_has_its_key(window, key, state):
    window.press("down", key)
    assert (window.marking.at(IN_A_ROW).state, window.marking.at(IN_A_ROW).confidence) == (state, 1.0)


def test_the_title_shows_frame_state_and_keys_and_other_keys_do_nothing(window):
    window.press("right", "x", None, "shift", "down")
    title = window.made.figure.axes[0].get_title()
    assert title.startswith(f"{SLIDE}, frame 9 of {COUNT}: unsure\n")
    assert "m: mark" in title
    assert window.saved == []


def test_the_strip_below_is_that_of_the_cursor_s_row_and_the_band_has_every_interval(window):
    _, band, row = window.made.figure.axes
    assert row.get_xlim() == (0, IN_A_ROW)
    assert len(band.patches) == 2
    window.press("down", "down", "s")
    assert row.get_xlim() == (2 * IN_A_ROW, 3 * IN_A_ROW)
    assert len(band.patches) == 4
    window.made.figure.canvas.draw()


def test_q_closes_the_window_alone(window):
    number = window.made.figure.number
    window.press("q")
    assert number not in plt.get_fignums()
    assert window.saved == []


def test_no_key_saves_a_picture_or_closes_the_window_besides(window):
    assert [name for name, keys in plt.rcParams.items() if name.startswith("keymap.") and keys] == []
