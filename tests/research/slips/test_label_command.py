"""`lsds learn label`: a window, pictures, or the agreement of two labellers, and one clear error for what is wrong."""

from __future__ import annotations

import gc
import json
import sys

import cv2
import matplotlib
import matplotlib.pyplot as plt
import pytest
from lsds_research.slips.labels import NAME, Interval, State, read_labels, write_labels
from matplotlib import rc_context
from matplotlib.backend_bases import FigureCanvasBase, KeyEvent
from research.slips.slid import COUNT, FIRST, LAST, SLIDE, STICK, TURN, copied, truth

from lsds.cli.main import main


@pytest.fixture
def folder(recordings, tmp_path, monkeypatch):
    """A copy of the recordings, as the working directory."""
    copied(recordings, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def screen(monkeypatch):
    """As if there were a screen: windows are shown to who presses these keys."""
    plt.switch_backend("agg")
    monkeypatch.setattr(matplotlib, "get_backend", lambda: "tkagg")
    monkeypatch.setattr(FigureCanvasBase, "draw_idle", lambda canvas: None)

    def use(*keys_of_each):
        left = list(keys_of_each)

        def show():
            gc.collect()
            canvas = plt.gcf().canvas
            for key in left.pop(0):
                canvas.callbacks.process("key_press_event", KeyEvent("key_press_event", canvas, key))
            plt.close("all")

        monkeypatch.setattr(plt, "show", show)

    with rc_context():
        yield use


def shown(intervals):
    return [(each.first, each.last, each.state, each.labeller) for each in intervals]


def test_keys_in_the_window_are_written_at_once_beside_the_recording(folder, screen):
    (folder / NAME).unlink()
    screen(["k", "right", "m", "down", "s", "q"])
    assert main(["learn", "label", SLIDE, "--labeller", "B"]) == 0
    assert shown(read_labels(folder / NAME)[SLIDE]) == [
        (0, 0, State.STICK, "B"),
        (1, 9, State.SLIP, "B"),
        (10, COUNT - 1, State.UNSURE, ""),
    ]


def test_labels_are_gone_on_with_and_those_of_other_recordings_kept(folder, screen, monkeypatch):
    monkeypatch.setenv("LOGNAME", "somebody")
    screen(["q"], ["up", "t", "q"])
    before = truth()
    assert main(["learn", "label", SLIDE, STICK]) == 0
    after = read_labels(folder / NAME)
    assert list(after) == [SLIDE, STICK, TURN]
    assert repr(after[SLIDE]) == repr(before[SLIDE])
    assert repr(after[TURN]) == repr(before[TURN])
    assert shown(after[STICK]) == [(0, 0, State.TOUCH, "somebody"), (1, COUNT - 1, State.STICK, "")]


def test_a_recording_with_dots_in_its_name_is_gone_on_with(folder, screen):
    (folder / SLIDE).rename(folder / "mug.v2")
    for key in ("s", "t"):
        screen([*["right"] * (key == "t"), key, "q"])
        assert main(["learn", "label", "mug.v2", "--labeller", "B", "--labels", "own.csv"]) == 0
    assert [state for _, _, state, _ in shown(read_labels(folder / "own.csv")["mug.v2"])] == [
        State.SLIP,
        State.TOUCH,
        State.UNSURE,
    ]


def test_the_folder_that_one_is_in_has_a_name_too(folder, screen, monkeypatch):
    monkeypatch.chdir(folder / SLIDE)
    screen(["s", "q"])
    assert main(["learn", "label", ".", "--labels", "../own.csv"]) == 0
    assert list(read_labels(folder / "own.csv")) == [SLIDE]


def test_pictures_are_drawn_of_the_whole_and_of_what_moves(folder, capsys):
    assert main(["learn", "label", SLIDE, "--pictures", "looks"]) == 0
    drawn = sorted(file.name for file in (folder / "looks" / SLIDE).iterdir())
    assert drawn == ["kymograph.png", f"strip_{FIRST - 3:04}-{LAST + 3:04}.png"]
    assert all(cv2.imread(str(folder / "looks" / SLIDE / name)).any() for name in drawn)
    assert f"{COUNT} frames, motion in 1 ranges" in capsys.readouterr().out
    assert repr(read_labels(folder / NAME)) == repr(truth()), "the labels are as they were"


def test_long_motion_is_cut_into_several_strips(folder, monkeypatch):
    monkeypatch.setattr("lsds_research.slips.pictures.STRIP", 8)
    assert main(["learn", "label", SLIDE, "--pictures", "looks"]) == 0
    assert sorted(file.stem for file in (folder / "looks" / SLIDE).glob("strip*")) == [
        "strip_0007-0014",
        "strip_0015-0022",
        "strip_0023-0024",
    ]


def test_two_labellers_are_compared_on_the_recordings_named(folder, capsys):
    second = truth()
    second[SLIDE] = [Interval(0, 11, State.STICK), Interval(12, LAST, State.SLIP), Interval(22, 29, State.STICK)]
    second[TURN] = [Interval(0, COUNT - 1, State.STICK)]
    write_labels(folder / "second.csv", second)
    assert main(["learn", "label", SLIDE, TURN, "--compare", "second.csv", "--json", "told.json"]) == 0
    out = capsys.readouterr().out
    assert "Cohen's kappa" in out
    result = json.loads((folder / "told.json").read_text())
    assert (result["videos"], result["frames"], result["intervals"], result["both"]) == (2, 60, 2, 1)
    assert result["same"] == pytest.approx(1 - 14 / 60)
    assert 0 < result["kappa"] < 1
    assert main(["learn", "label", STICK, "--compare", NAME, "--json", "-"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["same"], result["kappa"]) == (1.0, None), "where nothing slips there is no kappa, and no NaN in JSON"


def test_without_a_screen_the_error_has_a_remedy(folder, capsys):
    plt.switch_backend("agg")
    assert main(["learn", "label", SLIDE]) == 5
    error = capsys.readouterr().err
    assert "no window can be opened here" in error
    assert "--pictures" in error


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ([], 2, "VIDEOS"),
        (["gone.avi"], 2, "does not exist"),
        ([SLIDE, "--compare", "gone.csv"], 2, "does not exist"),
        ([SLIDE, "--compare", NAME, "--labels", "gone.csv"], 5, "gone.csv: no such file"),
        ([SLIDE, "--labels", "wrong.csv"], 5, "line 2: state is 'x'"),
        ([SLIDE, "--labels", "no/where.csv"], 5, "the folder does not exist"),
        ([SLIDE, "--json", "no/where.json"], 5, "the folder does not exist"),
        (["empty", "--pictures", "looks"], 5, "no images there"),
        (["broken.avi", "--pictures", "looks"], 5, "broken.avi: not a video"),
        ([SLIDE, "--pictures", "wrong.csv"], 2, "is a file"),
        ([SLIDE, "--pictures", "taken"], 5, "cannot be written"),
    ],
)
def test_what_is_wrong_is_one_message_and_an_exit_code(folder, capsys, arguments, code, message):
    plt.switch_backend("agg")
    (folder / "empty").mkdir()
    (folder / "broken.avi").write_bytes(b"nothing of a video")
    (folder / "wrong.csv").write_text("video,first,last,state\nmug,0,9,x\n")
    (folder / "taken").mkdir()
    (folder / "taken" / SLIDE).write_text("in the way")
    assert main(["learn", "label", *arguments]) == code
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error


def test_without_matplotlib_the_error_names_the_extra(folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["learn", "label", SLIDE]) == 3
    assert capsys.readouterr().err.rstrip().endswith("pip install 'lsds-tactile[plot]'")
