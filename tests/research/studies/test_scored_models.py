"""`lsds study models`: scores of finished models on held-out objects."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from lsds_research.collecting.objects import SEEN
from lsds_research.datasets import Dataset
from lsds_research.evaluation.fitting import Model
from lsds_research.evaluation.shipping import train
from research.frames import fit_and_save
from research.synthetic import dataset

from lsds.cli.main import cli
from lsds.registry.host import PluginHost


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Four objects, and a detector trained on two of them."""
    monkeypatch.chdir(tmp_path)
    data = dataset((*SEEN[:2], "book", "duster"))
    data.save(tmp_path / "data")
    seen = data.where((data["object"] == SEEN[0]) | (data["object"] == SEEN[1]))
    train(seen, Model("logistic"), PluginHost(), tmp_path / "mine.onnx")
    return tmp_path


def evaluate(*arguments):
    return CliRunner().invoke(cli, ["study", "models", *arguments])


def test_models_are_scored_on_what_they_have_not_learnt_from_beside_the_rules(folder):
    done = evaluate("data", "--model", "mine.onnx", "--json", "told.json", "--csv", "t.csv", "--plot", "p.png")
    assert done.exit_code == 0, done.output
    result = json.loads((folder / "told.json").read_text())
    rows = {(row["model"], row["object"]): row for row in result["rows"]}
    models = {"mine", "one-parameter rule", "majority"}
    assert set(rows) == {(model, name) for model in models for name in ("book", "duster", "all")}
    assert rows["majority", "all"]["accuracy"] < rows["mine", "all"]["accuracy"] <= 1
    assert "simulated" in result["title"]
    assert (folder / "p.png").read_bytes()[:4] == b"\x89PNG"
    assert (folder / "t.csv").read_text().startswith("model,object,accuracy")


def test_the_shipped_models_of_a_job_are_scored_where_none_is_named(folder):
    done = evaluate("data", "--job", "estimate", "--json", "-")
    assert done.exit_code == 0, done.output
    rows = json.loads(done.stdout[done.stdout.index("{") :])["rows"]
    assert {row["model"] for row in rows} == {
        "lstm",
        "imprint-gru",
        "field-gru",
        "mlp",
        "linear-window",
        "always zero",
        "constant in contact",
    }
    assert {row["object"] for row in rows} == {"book", "duster", "all"}
    zero = next(row for row in rows if row["model"] == "always zero" and row["object"] == "all")
    test = np.isin((data := dataset((*SEEN[:2], "book", "duster")))["object"], ("book", "duster"))
    assert zero["mae_cm_s"] == pytest.approx(100 * float(np.mean(data["speed"][test])), rel=1e-5)


def test_scores_on_objects_that_were_learnt_from_say_so(folder):
    done = evaluate("data", "--model", "mine.onnx", "--object", SEEN[0])
    assert done.exit_code == 0, done.output
    assert "objects, some of the training data" in done.output


def test_without_other_objects_the_rule_is_fitted_out_of_fold(folder):
    data = dataset(("book", "duster"))
    Dataset(data.columns, data.card).save(folder / "two")
    done = evaluate("two", "--model", "mine.onnx")
    assert done.exit_code == 0, done.output
    assert "one-parameter rule" in done.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--object", "bok"], "did you mean 'book'"),
        (["--model", "mine.onnx", "--job", "estimate"], "is a model to detect, not to estimate"),
        (["--model", "field-mpl"], "did you mean 'field-mlp'"),
        (["--plot", "nowhere/p.png"], "the folder does not exist"),
    ],
)
def test_mistakes_are_named(folder, arguments, message):
    done = evaluate("data", *arguments)
    assert done.exit_code
    assert message in done.output + str(done.exception)


def test_a_dataset_of_nothing_new_is_refused(folder):
    kind, path, _ = fit_and_save("logistic", folder, trained_on={"objects": [*SEEN[:2], "book", "duster"]})
    assert kind == "detector"
    done = evaluate("data", "--model", str(path))
    assert done.exit_code
    assert "were trained on all its objects" in str(done.exception)
