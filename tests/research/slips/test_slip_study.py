"""`lsds study slip` on three painted recordings, and `lsds learn train --labelled`."""

from __future__ import annotations

import csv
import json
import math
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from lsds_research.slips.folder import SHIPPED, LabelledRecording
from lsds_research.slips.labels import NAME, Interval, State, read_labels, write_labels
from lsds_research.slips.options import SlipOptions
from lsds_research.slips.plot import draw
from lsds_research.slips.study import SlipStudy, _curve, _row
from research.slips.slid import SLIDE, STICK, TURN, copied, truth

from lsds.cli.main import main
from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.errors import DataError, PluginNotFound
from lsds.models.artefact import load as load_model
from lsds.session.track import track

IMPRINT = ("--detector", "imprint", "--estimator", "imprint", "--jobs", "1")


@pytest.fixture
def folder(recordings, tmp_path, monkeypatch):
    """A copy of the recordings, in the working directory."""
    monkeypatch.chdir(tmp_path)
    return copied(recordings, tmp_path / "own")


def study(folder, seed=0, **options):
    values = {"path": str(folder), "detectors": ["imprint"], "estimators": ["imprint"], "jobs": 1, **options}
    return SlipStudy(SlipOptions(**values), BuildContext(VirtualClock(), seed)).run(lambda *_: None)


def test_the_imprint_notices_the_slides_without_a_false_alarm_and_measures_the_travel(recordings):
    result = study(recordings, refit=False)
    (row,) = result.rows
    assert (row["detector"], row["setup"], row["intervals"]) == ("imprint", "whole pad", 2)
    assert (row["found"], row["noticed"], row["per_100_moving"], row["onset"]) == (1.0, 1.0, 0.0, 0.0)
    assert (row["at_found"], row["at_noticed"]) == (1.0, 1.0)
    assert 0 <= row["at_low"] <= row["at_noticed"] <= row["at_high"] <= 1
    assert row["answered"] == 1.0
    (part,) = result.more
    (travel,) = part.rows
    assert (travel["estimator"], travel["slips"], travel["turns"], travel["answered"]) == ("imprint", 1, 1, 1.0)
    assert travel["off_share"] < 20
    assert travel["turn_off_share"] < 20
    assert (travel["travel_right"], travel["turn_right"]) == (1.0, 1.0)
    assert "measured" in result.title
    assert "3 of 1 objects" in result.title
    assert result.warnings == []


def test_recorded_runs_stand_for_videos(recordings, tmp_path):
    pytest.importorskip("mcap", reason="recordings need the extra record")
    own = tmp_path / "runs"
    own.mkdir()
    write_labels(own / NAME, read_labels(recordings / NAME))
    for name in (SLIDE, STICK, TURN):
        assert track(recordings / name, record=own / f"{name}.mcap").error is None
    (of_runs,), (of_images,) = study(own, refit=False).rows, study(recordings, refit=False).rows
    for key in ("intervals", "found", "noticed", "per_100_moving", "onset", "at_noticed", "answered"):
        assert of_runs[key] == of_images[key]


def test_the_same_seed_gives_the_same_figures(recordings):
    first, again = (study(recordings, refit=False, seed=3) for _ in range(2))
    assert first.rows == again.rows
    assert first.details["curves"] == again.details["curves"]


def test_every_installed_detector_and_estimator_is_asked(folder):
    write_labels(folder / NAME, {SLIDE: truth()[SLIDE]})
    result = study(folder, detectors=[], estimators=[], refit=False)
    asked = {row["detector"] for row in result.rows}
    assert {"imprint", "fused", "monotone", "threshold"} <= asked
    assert "onnx" not in asked
    assert set(result.details["curves"]) == asked
    assert {"imprint", "field"} <= {row["estimator"] for row in result.more[0].rows}


def test_fused_is_fitted_without_the_object_and_drawn_beside_the_others(recordings, tmp_path):
    folder = copied(recordings, tmp_path / "own", ("mug", "can", "cup"))
    result = study(folder)
    rows = {row["detector"]: row for row in result.rows}
    assert "fused, from the other setup" not in rows, "there is one setup only"
    fitted = rows["fused, without the object"]
    assert (fitted["found"], fitted["noticed"], fitted["per_100_moving"]) == (1.0, 1.0, 0.0)
    result.draw(tmp_path / "curves.png")
    assert cv2.imread(str(tmp_path / "curves.png")).shape[0] > 400


def test_the_command_prints_and_writes_what_it_found(folder, capsys):
    files = ["--csv", "table.csv", "--json", "told.json", "--plot", "curves.png"]
    assert main(["study", "slip", "own", *IMPRINT, "--no-refit", *files]) == 0
    out = capsys.readouterr().out
    assert "real recordings labelled by eye: 3 of 1 objects (measured)" in out
    assert "within 20 % or 2 px" in out
    assert "the first nine frames are not scored" in out
    with (folder.parent / "table.csv").open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["detector"], float(row["noticed"])) == ("imprint", 1.0)
    result = json.loads((folder.parent / "told.json").read_text())
    assert result["figures_are"] == "measured"
    assert result["failures"] == {}
    assert result["tables"][0][0]["estimator"] == "imprint"
    assert (folder.parent / "curves.png").stat().st_size > 10_000


def test_a_damaged_recording_is_skipped_and_reported(folder, capsys):
    (folder / TURN / "003.png").unlink()
    (folder / TURN / "003.png").write_bytes(b"no image")
    assert main(["study", "slip", "own", *IMPRINT, "--no-refit", "--json", "told.json"]) == 0
    assert "passed over: " in capsys.readouterr().err
    result = json.loads((folder.parent / "told.json").read_text())
    assert list(result["failures"]) == [TURN]
    assert result["rows"][0]["intervals"] == 1


def test_where_nothing_slips_shares_are_unknown_and_it_is_printed_all_the_same(folder, capsys):
    write_labels(folder / NAME, {STICK: truth()[STICK]})
    assert main(["study", "slip", "own", *IMPRINT, "--json", "told.json", "--plot", "curves.png"]) == 0
    result = json.loads((folder.parent / "told.json").read_text())
    assert result["rows"][0]["found"] is None
    assert result["rows"][0]["per_100_moving"] == 0.0
    assert result["tables"][0][0]["slips"] == 0


def test_a_wrong_file_of_labels_is_one_error_that_names_the_lines(folder, capsys):
    lines = (folder / NAME).read_text().splitlines()
    lines[2] = f"{SLIDE},11,21,slip,far,,,2,,"
    lines[4] = f"{STICK},0,29,sticks,,,,,,"
    (folder / NAME).write_text("\n".join(lines))
    assert main(["study", "slip", "own", *IMPRINT]) == 5
    (error,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert f"{NAME}: line 3: tx_px is 'far'" in error
    assert "line 3: confidence is '2'" in error
    assert "line 5: state is 'sticks'" in error


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ([], 2, "PATH"),
        (["gone"], 5, "gone: no such folder"),
        (["empty"], 5, "empty: holds none of the recordings that"),
        (["own", "--labels", "gone.csv"], 5, "gone.csv: no such file"),
        (["own", "--detector", "imprints"], 3, "imprint"),
        (["own", "--estimator", "imprints"], 3, "imprint"),
        (["own", "--alarms", "0"], 2, "alarms"),
        (["own", "--objects", "some"], 2, "scored-only"),
        (["own", "--json", "no/where.json"], 5, "the folder does not exist"),
        (["own", "--plot", "no/where.png"], 5, "the folder does not exist"),
    ],
)
def test_mistakes_are_one_message_and_an_exit_code(folder, capsys, arguments, code, message):
    (folder.parent / "empty").mkdir()
    assert main(["study", "slip", *arguments]) == code
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error


def test_of_the_shipped_labels_only_objects_on_which_nothing_is_tuned_are_scored(recordings):
    # Names alone matter: which objects are kept of recordings that were read.
    names = sorted(read_labels(SHIPPED))
    read = [SimpleNamespace(object=name.split("__")[0]) for name in names]
    study = SlipStudy(SlipOptions(path="folder"), BuildContext(VirtualClock(), 0))
    kept = study._kept(read, recordings / SLIDE)
    assert 0 < len(kept) < len(read)
    assert "baseball" in {own.object for own in kept}
    everything = SlipStudy(SlipOptions(path="folder", objects="all"), BuildContext(VirtualClock(), 0))
    assert everything._kept(read, recordings / SLIDE) == read
    assert study._kept(read, recordings) == read, "of a folder's own labels all are scored"
    foreign = [SimpleNamespace(object="mug")]
    assert study._kept(foreign, recordings / SLIDE) == foreign


def test_unknown_names_and_folders_raise_before_anything_is_read(recordings, tmp_path):
    with pytest.raises(PluginNotFound):
        study(recordings, detectors=["imprints"])
    with pytest.raises(DataError, match="no such folder"):
        study(tmp_path / "gone")


def made_up(score):
    """A recording of which every frame moves, the last 40 of 240 slip, and a detector says so above 0.9."""
    intervals = [Interval(0, 199, State.STICK), Interval(200, 239, State.SLIP)]
    outputs = SimpleNamespace(name="mug", count=240, setup="whole pad", moved_px=np.ones(240))
    return LabelledRecording("mug", intervals, outputs), np.where(np.isnan(score), np.nan, score > 0.9), score


def test_at_the_same_false_alarms_detectors_are_compared_by_their_scores():
    rng = np.random.default_rng(0)
    scores = [made_up(np.concatenate([rng.uniform(0, 1, 200), rng.uniform(0.5, 1.5, 40)])) for _ in range(6)]
    row = _row("made up", "both", scores, 5.0, 0)
    assert row["per_100_moving"] == pytest.approx(10, abs=2)
    assert row["found"] == pytest.approx(0.6, abs=0.1)
    assert row["at_found"] == pytest.approx(0.55, abs=0.1)
    assert row["at_found"] < row["found"]
    for asked, (false, _) in zip((0.5, 1, 1.5, 2, 3, 4, 5, 6, 8, 10), _curve(scores), strict=False):
        assert asked - 0.2 <= false <= asked
    noticed = [share for _, share in _curve(scores)]
    assert noticed == sorted(noticed)
    # A score on another scale is the same detector.
    scaled = [(own, slip, 100 * score - 7) for own, slip, score in scores]
    assert {**_row("made up", "both", scaled, 5.0, 0)} == row


def test_a_detector_that_abstains_raises_no_alarm_and_finds_nothing():
    scores = [made_up(np.full(240, np.nan)) for _ in range(2)]
    row = _row("mute", "both", scores, 5.0, 0)
    assert (row["answered"], row["found"], row["noticed"], row["at_found"]) == (0, 0, 0, 0)
    assert (row["per_100_moving"], row["intervals"]) == (0, 2)
    assert math.isnan(row["onset"])


def test_curves_are_drawn_without_a_false_alarm_and_without_a_slip(tmp_path):
    curves = {
        "imprint": [(0.0, 1.0), (0.0, 1.0)],
        "threshold": [(math.nan, math.nan)],
        "fused": [(4.0, 0.5), (8.0, 1.0)],
    }
    draw(tmp_path / "curves.png", curves, 5.0, "three recordings")
    assert (tmp_path / "curves.png").stat().st_size > 10_000


# -- training ----------------------------------------------------------------------------------------------


@pytest.fixture
def one_process(monkeypatch):
    monkeypatch.setattr("lsds.cli.threads.processes", lambda: 1)


def test_a_detector_is_trained_on_labelled_recordings(recordings, tmp_path, monkeypatch, capsys, one_process):
    monkeypatch.chdir(tmp_path)
    folder = copied(recordings, tmp_path / "own", ("mug", "can", "cup"))
    (folder / "cup__turn" / "000.png").unlink()
    (folder / "cup__turn" / "000.png").write_bytes(b"no image")
    assert main(["learn", "train", "fused", "--labelled", "own", "--out", "slip.onnx", "--json", "told.json"]) == 0
    shown = capsys.readouterr()
    assert "passed over: " in shown.err
    assert "measured" in shown.out
    card = load_model(tmp_path / "slip.onnx", "detect").card
    assert card.figures_are == "measured"
    assert card.trained_on["objects"] == ["can", "cup", "mug"]
    assert card.trained_on["recordings"] == 8
    assert json.loads((tmp_path / "told.json").read_text())["scores"]["accuracy"] > 0.9


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ([], 2, "give --data, --labelled, or both"),
        (["--labelled", "gone"], 5, "gone: no such folder"),
        (["--labelled", "empty"], 5, "holds none of the recordings"),
        (["--labelled", "own", "--without", "mugs"], 2, "did you mean 'mug'"),
        (["--labelled", "own", "--without", "mug"], 2, "leaves no object"),
    ],
)
def test_unusable_training_data_is_an_error(folder, capsys, one_process, arguments, code, message):
    (folder.parent / "empty").mkdir()
    assert main(["learn", "train", "fused", "--out", "slip.onnx", *arguments]) == code
    assert message in capsys.readouterr().err
    assert not (folder.parent / "slip.onnx").exists()
