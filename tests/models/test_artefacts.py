"""A model's file and card: a damaged or foreign file, or another model's card, is one clear ModelError."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from functools import partial

import numpy as np
import onnx
import pytest
from lsds_research.learners.graph import Graph
from onnx import TensorProto, helper
from research.frames import fit_and_save

from lsds.errors import DataError, ModelError
from lsds.models import artefact
from lsds.models.artefact import Card, load, save
from lsds.models.signals import SIGNAL_SETS, UNITS
from lsds.models.window import Window

FIELD = SIGNAL_SETS["field"]


@pytest.fixture
def model(tmp_path):
    return fit_and_save("logistic", tmp_path, threshold=0.4, trained_on={"objects": ["book"]})[1]


def graph(length, width, y=1, shape=()):
    """A model that gives the first `y` signals of a window."""
    own = Graph(length, width)
    flat = own.add("Flatten", "x")
    bounds = [own.constant(np.array([number])) for number in (0, y, 1)]
    return own.finish(own.add("Slice", flat, *bounds), shape)


def plain(inputs, outputs, nodes):
    """A model of any interface: inputs and outputs are (name, type, shape)."""
    made = [[helper.make_tensor_value_info(*info) for info in infos] for infos in (inputs, outputs)]
    opset = [helper.make_opsetid("", 18)]
    return helper.make_model(
        helper.make_graph(nodes, "g", *made), opset_imports=opset, ir_version=10
    ).SerializeToString()


def rewritten(path, **changes):
    card = path.with_suffix(".json")
    content = json.loads(card.read_text())
    for key, value in changes.items():
        if value is None:
            del content[key]
        else:
            content[key] = value
    card.write_text(json.dumps(content))


def foreign(folder, content, **card):
    path = folder / "foreign.onnx"
    save(
        path, content, Card(**{"name": "f", "job": "detect", "signals": FIELD, "length": 4, "figures_are": "", **card})
    )
    return path


def refused(path, match, job="detect"):
    with pytest.raises(ModelError, match=match) as caught:
        load(path, job)
    text = str(caught.value)
    assert path.stem in text, "it names the file"
    assert "\n" not in text


def test_a_saved_model_is_loaded_as_it_was(model):
    loaded = load(model, "detect")
    assert loaded.card.name == "logistic"
    assert loaded.card.signals == FIELD
    assert (loaded.card.length, loaded.card.threshold) == (4, 0.4)
    assert loaded.card.trained_on == {"objects": ["book"]}
    y = loaded.run(np.zeros((3, 4, len(FIELD)), np.float32))
    assert y.shape == (3,)
    card = json.loads(model.with_suffix(".json").read_text())
    assert card["signals"] == {name: UNITS[name] for name in FIELD}
    assert card["sha256"] == hashlib.sha256(model.read_bytes()).hexdigest()


def test_a_card_of_a_fit_that_has_diverged_replaces_nothing(model):
    before, card = model.read_bytes(), load(model, "detect").card
    with pytest.raises(DataError, match="diverged"):
        save(model, b"other", replace(card, threshold=float("nan")))
    assert model.read_bytes() == before
    assert load(model, "detect").card == card


def test_a_missing_file_or_card(model):
    card = model.with_suffix(".json")
    text = card.read_text()
    card.unlink()
    refused(model, r"logistic\.json: cannot read the model's card")
    card.write_text(text)
    model.unlink()
    refused(model, "cannot be read: No such file")


@pytest.mark.parametrize("name", ["lsds", "lsds-tactile"])
def test_a_card_with_the_version_of_lsds_under_either_name(model, name):
    file = model.with_suffix(".json")
    card = json.loads(file.read_text())
    file.write_text(json.dumps(card | {"versions": {name: "0.1.0"}}))
    assert load(model, "detect").card.versions == {name: "0.1.0"}


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "\x00", '{"format": "other"}', '"lsds model 1"'])
def test_a_card_that_is_none(model, text):
    model.with_suffix(".json").write_text(text)
    refused(model, r"not (a model's card|the card of)")


def test_a_card_that_is_not_text(model):
    model.with_suffix(".json").write_bytes(b"\xff\xfe\x00")
    refused(model, "not a model's card")


@pytest.mark.parametrize("field", ["name", "signals", "length", "figures_are", "threshold", "intervals"])
def test_an_incomplete_card(model, field):
    rewritten(model, **{field: None})
    refused(model, f"incomplete or wrong: KeyError: '{field}'")


@pytest.mark.parametrize(
    "changes",
    [
        {"length": 0},
        {"length": "four"},
        {"threshold": 7},
        {"threshold": "x"},
        {"intervals": [1, 2]},
        {"intervals": [1, 2, 3, -4]},
        {"intervals": 1.0},
        {"signals": 3},
        {"signals": ["v_net"]},
        {"intervals": [1, 2, 3, float("nan")]},
        {"threshold": float("nan")},
    ],
)
def test_a_card_with_nonsense(model, changes):
    rewritten(model, **changes)
    refused(model, "incomplete or wrong")


def test_a_file_that_is_not_the_cards(model):
    content = bytearray(model.read_bytes())
    content[len(content) // 2] ^= 1
    model.write_bytes(content)
    refused(model, r"does not match its card logistic\.json")
    model.write_bytes(b"")
    refused(model, "does not match its card")


def test_signals_and_units_that_this_version_does_not_know(model):
    signals = {name: UNITS[name] for name in FIELD}
    rewritten(model, signals={**signals, "smell": "1"})
    refused(model, "unknown signal smell")
    rewritten(model, signals={})
    refused(model, "exactly once, got: none")
    rewritten(model, signals={**signals, "area": "px"})
    refused(model, "was trained on area in px, here it is in 1")


def test_a_model_of_the_other_job(model):
    refused(model, "is a model to detect, not to estimate", "estimate")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not onnx", b"\x08\x08" * 50])
def test_bytes_that_are_no_model(tmp_path, content):
    refused(foreign(tmp_path, content), "not a model that can be run")


def test_a_truncated_model_with_a_card_that_matches_it(tmp_path):
    content = graph(4, len(FIELD))
    refused(foreign(tmp_path, content[: len(content) // 2]), "not a model that can be run")


def test_a_model_with_another_interface(tmp_path):
    width, number = len(FIELD), TensorProto.FLOAT
    y = ("y", number, ["n", 4, width])
    same = [helper.make_node("Identity", ["image"], ["y"])]
    refused(foreign(tmp_path, plain([("image", number, ["n", 4, width])], [y], same)), "its inputs are image tensor")
    double = ("x", TensorProto.DOUBLE, ["n", 4, width])
    cast = [helper.make_node("Cast", ["x"], ["y"], to=number)]
    refused(foreign(tmp_path, plain([double], [y], cast)), r"its inputs are x tensor\(double\)")
    x = ("x", number, ["n", 4, width])
    two = [helper.make_node("Add", ["x", "z"], ["y"])]
    refused(foreign(tmp_path, plain([x, ("z", *x[1:])], [y], two)), "its inputs are x .*, z")
    labels = [helper.make_node("Cast", ["x"], ["y"], to=TensorProto.INT64)]
    out = ("y", TensorProto.INT64, ["n", 4, width])
    refused(foreign(tmp_path, plain([x], [out], labels)), r"its outputs are y tensor\(int64\)")
    fixed = [helper.make_node("Flatten", ["x"], ["y"])]
    one = plain([("x", number, [1, 4, width])], [("y", number, [1, 4 * width])], fixed)
    refused(foreign(tmp_path, one), "cannot be run")
    refused(foreign(tmp_path, graph(4, width - 1)), "takes windows of")
    refused(foreign(tmp_path, graph(3, width)), r"takes windows of \[3, 14\], but its card states \[4, 14\]")


def test_a_model_that_gives_other_than_its_job_asks_for(tmp_path):
    width = len(FIELD)
    refused(foreign(tmp_path, graph(4, width, 8, (8,))), "gives .* not 1 numbers")
    estimator = foreign(tmp_path, graph(4, width, 7, (7,)), job="estimate")
    refused(estimator, r"gives \[7\] for a window, not 8 numbers", "estimate")
    assert load(foreign(tmp_path, graph(4, width, 8, (8,)), job="estimate"), "estimate").card.job == "estimate"


def test_a_graph_that_ends_elsewhere_is_not_written():
    own = Graph(1, 3)
    first = own.add("Flatten", "x")
    own.add("Relu", first)
    with pytest.raises(ValueError, match="not the output of the last node"):
        own.finish(first, (3,))
    assert onnx.load_from_string(graph(1, 3, 2)).producer_name == "lsds"


def test_a_bound_model_gives_what_a_free_one_gives_past_the_wrapper_and_through_it(model, monkeypatch):
    loaded = load(model, "detect")
    window = Window(4, len(FIELD))
    past = loaded.bind(window)
    monkeypatch.setattr(artefact, "_bound", lambda session, binding: partial(session.run_with_iobinding, binding))
    through = loaded.bind(window)
    rng = np.random.default_rng(0)
    for _ in range(6):
        window.push((1e-4 * rng.standard_normal(len(FIELD))).tolist())
        assert past() == through() == loaded.run(window.frames).tolist()


def test_a_runtime_without_the_short_way_is_run_through_its_wrapper():
    class Session:
        def run_with_iobinding(self, binding):
            return f"ran {binding}"

    assert artefact._bound(Session(), "it")() == "ran it"


def test_a_model_that_cannot_be_written_is_one_clear_error(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(DataError, match="cannot be written"):
        save(tmp_path / "file" / "m.onnx", b"", Card("m", "detect", FIELD, 4, "simulated"))
