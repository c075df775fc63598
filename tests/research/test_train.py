"""`lsds learn train`: training on one or several datasets, scores compared with trivial baselines, clear errors."""

import json
from itertools import pairwise

import numpy as np
import pytest
from click.testing import CliRunner
from lsds_research.datasets import Dataset, merged
from research.synthetic import dataset

from lsds.cli.main import cli
from lsds.errors import DataError
from lsds.models.artefact import load as load_model


def saved(folder, objects, seed=0):
    data = dataset(objects, seed=seed)
    Dataset(data.columns, {**data.card, "seed": seed, "labels": "truth, smoothed"}).save(folder)
    return folder


def train(*arguments):
    return CliRunner().invoke(cli, ["learn", "train", *map(str, arguments)])


def test_it_writes_a_model_and_prints_the_scores_of_the_rules(tmp_path):
    first, second = saved(tmp_path / "first", "abcd"), saved(tmp_path / "second", "abef", seed=1)
    out, report = tmp_path / "mine.onnx", tmp_path / "told.json"
    done = train("logistic", "--data", first, "--data", second, "--without", "f", "--out", out, "--json", report)
    assert done.exit_code == 0, done.output
    assert "one-parameter rule" in done.output
    assert "majority" in done.output
    scores = json.loads(report.read_text())["scores"]
    assert 0.5 < scores["beside"]["majority"]["accuracy"] < scores["accuracy"] <= 1
    origin = load_model(out, "detect").card.trained_on
    assert origin["objects"] == list("abcde")
    assert origin["recordings"] == 12 + 9
    assert [part["seed"] for part in origin["datasets"].values()] == [0, 1]


def test_an_estimator_stands_beside_zero_and_a_constant(tmp_path):
    out = tmp_path / "speed.onnx"
    done = train("linear-window", "--data", saved(tmp_path / "data", "abcdef"), "--out", out)
    assert done.exit_code == 0, done.output
    assert "always zero" in done.output
    assert "mae (m/s)" in done.output


def test_recordings_of_two_datasets_stay_apart_though_they_are_called_alike():
    # The same protocol on another day: all names and the card are the same, what was measured is not.
    first, second = dataset("ab"), dataset("ab", seed=1)
    both = merged([("x", first), ("y", Dataset(second.columns, {**second.card, "figures_are": "measured"}))])
    assert len(both.starts) == 13
    assert both.card["figures_are"] == "simulated and measured"
    assert set(both.card) == {"figures_are", "job", "datasets"}
    assert all(len(set(both["recording"][a:b].tolist())) == 1 for a, b in pairwise(both.starts))
    assert np.array_equal(both["slip"], np.concatenate([first["slip"], second["slip"]]))


def test_a_recording_in_two_datasets_is_an_error(tmp_path):
    first = dataset("ab")
    other = dataset("bc", seed=1)
    some = first.where(first["recording"] == "a0")
    with pytest.raises(DataError, match="z: recording a0 is the same as one of x"):
        merged([("x", first), ("y", other), ("z", Dataset(some.columns, {"job": "catch"}))])
    saved(tmp_path / "data", "abc")
    twice = train("logistic", "--data", tmp_path / "data", "--data", tmp_path / "data", "--out", tmp_path / "m.onnx")
    assert "is the same as one of" in str(twice.exception)


def test_a_card_is_json_that_every_reader_takes(tmp_path):
    done = train("logistic", "--data", saved(tmp_path / "data", "abcd"), "--out", tmp_path / "mine.onnx")
    assert done.exit_code == 0, done.output

    def refuse(constant):
        raise ValueError(constant)

    card = json.loads((tmp_path / "mine.json").read_text(), parse_constant=refuse)
    assert card["scores"]["beside"]["majority"]["precision"] is None
    assert " -" in done.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--without", "bok"], "did you mean 'book'"),
        (["--without", "book", "--without", "can", "--without", "ruler"], "leaves no object to train on"),
        (["--json", "nowhere/told.json"], "the folder does not exist"),
        (["--out", "nowhere/mine.onnx"], "the folder does not exist"),
        (["--out", "mine.pt"], "must end in .onnx"),
        (["--option", "signals"], "needs KEY=VALUE"),
    ],
)
def test_mistakes_are_reported_before_anything_is_fitted(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    saved(tmp_path / "data", ("book", "can", "ruler"))
    done = train("logistic", "--data", "data", "--out", "mine.onnx", *arguments)
    assert done.exit_code
    assert message in done.output + str(done.exception)
    assert not list(tmp_path.rglob("*.onnx"))
