"""The entry `real` of model cards: measured on labelled recordings, and added to the earlier entries."""

from __future__ import annotations

import json

import pytest
from lsds_research import make_models
from lsds_research.slips import on_cards
from lsds_research.slips.folder import labels_of, read_folder


@pytest.fixture
def cards(tmp_path, monkeypatch):
    """A folder with two cards: of a detector that learnt from labelled recordings, and of one that did not."""
    for name, datasets in (("imprint", {"labelled": {}, "detection": {}}), ("threshold", {"detection": {}})):
        content = {"name": name, "trained_on": {"datasets": datasets}}
        (tmp_path / f"{name}.json").write_text(json.dumps(content), encoding="utf-8")
    monkeypatch.setattr(on_cards, "model_path", lambda name, _: tmp_path / f"{name}.onnx")
    return tmp_path


def test_scores_are_measured_and_earlier_entries_of_a_card_stay(recordings, cards, monkeypatch):
    known, _ = read_folder(recordings, labels_of(recordings))
    monkeypatch.setattr(on_cards, "scored_only", lambda: frozenset({known[0].object}))
    written = on_cards.write_on_cards(recordings, ["imprint", "threshold"])
    card = json.loads((cards / "imprint.json").read_text(encoding="utf-8"))
    assert card["real"] == written["imprint"]
    assert card["name"] == "imprint"
    assert card["real"]["fitted_on"] == {"recordings": [], "frames": 0}, "all are of the object that is only scored"
    assert (card["real"]["scored_on"]["recordings"], card["real"]["scored_on"]["slips"]) == (3, 2)
    scores = card["real"]["scores"]
    assert (scores["found"], scores["noticed"], scores["false_alarms_per_100_moving"]) == (1.0, 1.0, 0.0)


def test_recordings_that_were_learnt_from_are_named_and_not_scored(recordings, cards):
    written = on_cards.write_on_cards(recordings, ["imprint", "threshold"])
    assert len(written["imprint"]["fitted_on"]["recordings"]) == 3
    assert written["imprint"]["fitted_on"]["frames"] > 10
    assert written["threshold"]["fitted_on"]["recordings"] == []
    assert written["imprint"]["scored_on"]["recordings"] == 0
    assert set(written["imprint"]["scores"].values()) == {None}


def test_real_takes_one_folder(capsys):
    assert make_models.main(["--real"]) == 2
    assert "--real FOLDER" in capsys.readouterr().err
