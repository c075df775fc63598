"""`lsds study incipient-slip`: the study on a small dataset, the command on real recordings, and their mistakes."""

from __future__ import annotations

import csv
import json
import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from lsds_research.clips import model as clips_model
from lsds_research.incipient import models as incipient_models
from lsds_research.incipient import study as incipient
from lsds_research.incipient.models import frame_scores, video_scores
from lsds_research.incipient.options import IncipientOptions
from lsds_research.incipient.plot import roc
from lsds_research.incipient.table import videos_of
from lsds_research.learners.clip_model import clip_model, exported
from research.labelled import dataset, row, write_index

from lsds.cli.main import main
from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.errors import DataError, ModelError

DATA = Path(os.environ.get("LSDS_DATA", "")) / "incipient_slip"
real = pytest.mark.skipif(
    "LSDS_DATA" not in os.environ or not DATA.is_dir(),
    reason="needs real recordings: set LSDS_DATA to a folder that holds incipient_slip/",
)


@pytest.fixture(scope="module")
def videos():
    return videos_of(dataset(4))


def study(**options):
    values = {"path": "folder", "cache": "none", "repeats": 2, "trees": 20, "jobs": 1, **options}
    return incipient.IncipientStudy(IncipientOptions(**values), BuildContext(VirtualClock(), 0))


@pytest.fixture
def small(monkeypatch):
    """The study of a made-up dataset of so many objects."""

    def use(objects):
        monkeypatch.setattr(incipient, "load", lambda *_: dataset(objects))

    return use


def test_every_model_stands_beside_what_knows_nothing(small, tmp_path):
    small(4)
    seen = []
    result = study(model="none").run(lambda done, whole: seen.append(done / whole))
    assert any("4 objects are few to train on" in note for note in result.notes)
    assert seen == sorted(seen)
    assert seen[-1] <= 1
    rows = {(r["model"], r["unit"]): r for r in result.rows}
    whole = rows["whole recording: mean of 32 clips of 48 frames", "recording"]
    assert whole["auc"] > 0.95
    assert whole["auc_low"] <= whole["auc"] <= whole["auc_high"]
    assert rows["majority", "recording"]["auc"] == 0.5
    # Here length is the label; no model sees it.
    assert rows["length alone (no model here sees it)", "recording"]["auc"] == 1.0
    for name in (
        "labels shuffled by recording",
        "online: one window of 12 frames",
        "one number: mean speed while moving",
    ):
        assert any(model == name for model, _ in rows)
    online = result.details["online"]
    assert len(online["auc_by_share_seen"]["mean"]) == len(online["shares_seen"]) == 10
    assert set(online["window_auc"]) == {"by_object", "by_object_shuffled", "random", "random_shuffled"}
    result.draw(tmp_path / "roc.png")
    assert (tmp_path / "roc.png").stat().st_size > 20_000


def test_the_same_seed_gives_the_same_figures(small):
    small(2)
    first, second = (study(model="none", trees=10, repeats=1).run(lambda *_: None).rows for _ in range(2))
    assert first == second


def test_one_object_alone_needs_a_model_from_elsewhere(small, tmp_path, monkeypatch):
    monkeypatch.setattr(incipient_models, "CLIP_MODEL", "none")
    small(1)
    with pytest.raises(DataError, match="--train"):
        study(model="none").run(lambda *_: None)
    monkeypatch.setattr(incipient, "load", lambda folder, *_: dataset(4 if folder.name == "many" else 1))
    monkeypatch.setattr(incipient, "read_index", lambda folder: None)
    result = study(model="none", train="many").run(lambda *_: None)
    assert [r["model"] for r in result.rows] == ["whole clips, trained on 3 objects of many"]
    result.draw(tmp_path / "roc.png")


def test_a_clip_model_is_the_forest_that_it_was_fitted_as(videos, tmp_path):
    onnx, middle = exported(videos.clip, videos.slip, 0, trees=20)
    clips_model.save(tmp_path / "clips.onnx", onnx, middle, ["b", "a"], "here")
    model = clips_model.load(tmp_path / "clips.onnx")
    assert model.objects == ("a", "b")
    rows = videos.clip.copy()
    rows[0, :5] = np.nan
    expected = clip_model(20)(videos.clip, videos.slip, 0)(rows)
    np.testing.assert_allclose(model(rows), expected, atol=1e-5)


def test_a_damaged_or_foreign_clip_model_is_one_clear_error(videos, tmp_path):
    path = tmp_path / "clips.onnx"
    with pytest.raises(ModelError, match="no clip model with a card"):
        clips_model.load(path)
    clips_model.save(path, *exported(videos.clip, videos.slip, 0, trees=10), ["a"], "here")
    card = json.loads(path.with_suffix(".json").read_text())
    path.with_suffix(".json").write_text(json.dumps(card | {"frames": 47}))
    with pytest.raises(ModelError, match="other figures"):
        clips_model.load(path)
    path.with_suffix(".json").write_text(json.dumps(card | {"format": "lsds model 1"}))
    with pytest.raises(ModelError, match="not the card"):
        clips_model.load(path)
    path.with_suffix(".json").write_text(json.dumps(card))
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(ModelError, match="damaged"):
        clips_model.load(path)


def test_a_shipped_clip_model_speaks_of_objects_that_it_has_not_seen(small, videos, tmp_path, monkeypatch):
    monkeypatch.setattr(incipient_models.models, "__file__", str(tmp_path / "__init__.py"))
    monkeypatch.setattr(incipient, "_both", lambda videos: False)  # Nothing is fitted here: what was before is asked.
    path = tmp_path / "clips.onnx"
    clips_model.save(path, *exported(videos.clip, videos.slip, 0, trees=20), ["thing0", "other"], "here")
    small(4)
    found = [r for r in study().run(lambda *_: None).rows if r["model"].startswith("shipped clip model")]
    assert [(r["tested"], r["auc"] > 0.9) for r in found] == [("3 objects it lacks", True)]
    clips_model.save(path, *exported(videos.clip, videos.slip, 0, trees=20), [f"thing{k}" for k in range(4)], "here")
    result = study().run(lambda *_: None)
    assert not [r for r in result.rows if r["model"].startswith("shipped clip model")]
    assert any("no simulation-trained detector is shipped" in note for note in result.notes)


def loud(names, length=2):
    """A stand-in for an artefact: as probable as its first signal is large."""
    card = SimpleNamespace(signals=names, length=length, name="loud", threshold=0.5, figures_are="simulated")
    return SimpleNamespace(card=card, run=lambda x: x[:, -1, 0])


def test_a_detector_is_asked_frame_by_frame_and_pooled_while_the_markers_move(videos):
    model = loud(("mean_speed", "v_net"))
    scores = frame_scores(model, videos, 1.0)
    np.testing.assert_array_equal(scores, videos.data["mean_speed"].astype(float))
    np.testing.assert_allclose(frame_scores(model, videos, 4.0), scores / 4, rtol=1e-6)
    np.testing.assert_allclose(frame_scores(loud(("dt",)), videos, 4.0), 0.16, rtol=1e-6)
    np.testing.assert_array_equal(frame_scores(loud(("shear",)), videos, 4.0), videos.data["shear"].astype(float))
    moved = videos.data["mean_speed"] * 0.04 > 6.25e-6
    first = slice(0, int(videos.starts[1]))
    expected = np.quantile(scores[first][moved[first]], 0.75)
    assert video_scores(videos, scores, 0.75, True)[0] == pytest.approx(expected)
    assert video_scores(videos, scores, 0.9, False)[0] == pytest.approx(np.quantile(scores[first], 0.9))


def test_a_model_that_cannot_be_loaded_fails_before_anything_is_fitted(small, monkeypatch):
    small(2)
    monkeypatch.setattr(incipient, "cross_validated", lambda *_: pytest.fail("fitted"))
    with pytest.raises(ModelError, match=r"missing\.(json|onnx)"):
        study(model="missing.onnx").run(lambda *_: None)


def test_a_roc_curve_passes_ties_together():
    false, true = roc(np.array([True, False, True, False]), np.array([0.9, 0.5, 0.5, 0.1]))
    np.testing.assert_allclose(false, [0, 0, 0.5, 1])
    np.testing.assert_allclose(true, [0, 0.5, 1, 1])


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["nowhere"], 5, "there is no such folder"),
        (["empty"], 5, "no index.csv there"),
        (["short"], 5, "column slip missing"),
        (["good", "--model", "missing.onnx", "--cache", "none"], 5, "none of its 1 videos can be used"),
        (["good", "--plot", "no/such/folder.png"], 5, "create the folder first"),
        (["good", "--save-clip-model", "model.bin"], 2, "ends in .onnx"),
        ([], 2, "PATH"),
        (["good", "--train", "nowhere"], 5, "there is no such folder"),
    ],
)
def test_mistakes_are_one_message_and_an_exit_code(tmp_path, monkeypatch, capsys, arguments, code, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    write_index(tmp_path / "short", [row(1)], ("video", "recording", "object", "camera"))
    write_index(tmp_path / "good", [row(1)])
    assert main(["study", "incipient-slip", *arguments]) == code
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error


def test_help_has_examples(capsys):
    assert main(["study", "incipient-slip", "--help"]) == 0
    assert "lsds study incipient-slip recordings/ --plot roc.png" in capsys.readouterr().out


@real
def test_a_few_real_recordings_are_read_scored_and_drawn(tmp_path, capsys):
    wanted = ("wire3D__e", "usb_hub__e", "marker_pen__e1__", "glass_box__e1__")
    with (DATA / "index.csv").open(encoding="utf-8") as file:
        rows = [r for r in csv.DictReader(file) if Path(r["video"]).name.startswith(wanted)]
    for listed in rows:
        listed["video"] = str(DATA / listed["video"])
    rows[0]["video"] = "videos/gone.avi"
    write_index(tmp_path / "few", rows)
    out = {name: tmp_path / f"out.{name}" for name in ("json", "csv", "png")}
    arguments = ["study", "incipient-slip", str(tmp_path / "few"), "--repeats", "1", "--jobs", "1"]
    arguments += ["--model", "none", "--cache", str(tmp_path / "cache")]
    arguments += ["--json", str(out["json"]), "--csv", str(out["csv"])]
    assert main([*arguments, "--plot", str(out["png"])]) == 0
    shown = capsys.readouterr()
    assert "gone.avi" in shown.err
    assert "whole recording: mean of 32 clips of 48 frames" in shown.out
    result = json.loads(out["json"].read_text())
    assert len(result["failures"]) == 1
    assert len(result["rows"]) == len(out["csv"].read_text().splitlines()) - 1
    assert out["png"].stat().st_size > 20_000


@real
@pytest.mark.slow
def test_unseen_objects_are_classified_on_all_real_recordings(tmp_path):
    target = tmp_path / "all.json"
    assert main(["study", "incipient-slip", str(DATA), "--model", "none", "--json", str(target)]) == 0
    rows = {(r["model"], r["unit"]): r for r in json.loads(target.read_text())["rows"]}
    whole = rows["whole recording: mean of 32 clips of 48 frames", "recording"]
    assert whole["auc"] >= 0.94
    assert whole["accuracy"] >= 0.87
    assert 0.4 < rows["labels shuffled by recording", "recording"]["auc"] < 0.6
    assert whole["auc_low"] > rows["length alone (no model here sees it)", "recording"]["auc_high"]
