"""Scores: rules have the parameters they should, controls end at chance, tables say what was measured."""

import json
import shutil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_research.collecting.campaign import study
from lsds_research.collecting.objects import SEEN, UNSEEN
from lsds_research.datasets import Dataset
from lsds_research.evaluation import detection, severity
from lsds_research.evaluation.controls import contact_constant, nuisance, rule_score, rule_threshold, shuffled
from lsds_research.evaluation.fitting import Model, labelled, task
from lsds_research.evaluation.shipping import train
from lsds_research.reproduce import jobs, measure
from lsds_research.reproduce.plot import plot_reproduction
from lsds_research.reproduce.report import markdown
from research.synthetic import dataset

from lsds.errors import DataError
from lsds.models.artefact import load as load_model
from lsds.models.intervals import conformal
from lsds.registry.host import PluginHost

HOST = PluginHost()


@given(st.lists(st.tuples(st.sampled_from([0.0, 0.1, 0.2, 0.5, 1.0]), st.booleans()), min_size=1, max_size=30))
def test_the_rule_s_threshold_is_the_best_there_is(rows):
    score, slip = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    found = rule_threshold(score, slip)
    best = max(np.mean((score > limit) == slip) for limit in [-1.0, *score, 2.0])
    assert np.mean((score > found) == slip) == pytest.approx(best)


def test_the_rule_looks_at_two_frames_of_one_recording():
    data = dataset(("a", "b"), 1)
    score, v = rule_score(data), np.nan_to_num(data["v_net"])
    first = data.starts[1]
    assert score[first] == pytest.approx(v[first])
    assert score[first + 5] == pytest.approx(max(v[first + 4], v[first + 5]))


def test_shuffled_labels_are_other_recordings_labels():
    data = dataset()
    other = shuffled(data, 1)
    assert np.array_equal(other["v_net"], data["v_net"], equal_nan=True)
    assert not np.array_equal(other["slip"], data["slip"])
    assert sorted(other["slip"].tolist()) == sorted(data["slip"].tolist())


def test_a_learner_beats_the_majority_and_its_controls_do_not():
    data, model = dataset(), Model("logistic")
    row = detection.cross_validate(data, model, HOST, "object")
    assert row["accuracy"] > 0.85
    assert row["accuracy_low"] <= row["accuracy"] <= row["accuracy_high"]
    assert row["auc"] > detection.cross_validate(data, model, HOST, "object", labels="shuffled")["auc"] + 0.1
    blind = detection.cross_validate(data, nuisance(model), HOST, "object")
    assert blind["auc"] < 0.65
    assert detection.majority(labelled(data, "detect"))["accuracy"] == pytest.approx(
        max(np.mean(data["slip"]), 1 - np.mean(data["slip"]))
    )
    assert detection.one_parameter(data, "object")["accuracy"] > 0.8


def test_unseen_objects_have_a_row_each_and_one_for_all():
    data = dataset()
    test = data["object"] == "f"
    rows = detection.unseen(data.where(~test), data.where(test), [Model("logistic")], HOST)
    assert [(row["model"], row["object"]) for row in rows] == [
        ("logistic", "f"),
        ("logistic", "all"),
        ("one-parameter rule", "f"),
        ("one-parameter rule", "all"),
        ("majority", "f"),
        ("majority", "all"),
    ]
    assert rows[0]["accuracy"] == rows[1]["accuracy"]


def test_severity_has_intervals_that_cover_what_they_say():
    data = dataset()
    test = np.isin(data["object"], ("e", "f"))
    seen, other = data.where(~test), data.where(test)
    rows = severity.calibrated(seen, Model("linear-window"), HOST).scored(other)
    rows += severity.plain_unseen(labelled(seen, "estimate"), labelled(other, "estimate"))
    by = {(row["model"], row["object"]): row for row in rows}
    own = by["linear-window", "all"]
    assert own["mae"] < by["always zero", "all"]["mae"]
    assert 0.7 < own["coverage"] <= 1
    zero = by["always zero", "all"]
    assert zero["mae"] == pytest.approx(float(np.mean(data["speed"][test])), rel=1e-5)
    assert contact_constant(np.array([0.2, 0.2, 0.0]), np.array([0.01, 0.03, 0.5])) == pytest.approx(0.02)


def test_the_constant_in_contact_is_not_fitted_on_the_object_that_it_answers_for():
    data = dataset(("slow", "fast"), 1)
    speed = np.where(data["object"] == "slow", 0.01, 0.03).astype(np.float32)
    data = Dataset({**data.columns, "velocity_y": speed}, data.card)
    own = labelled(data, "estimate")
    slow = own.part(own.column("object") == "slow")
    alone, other = (severity.baselines(own, part)[1]["mae"] for part in (own, slow))
    assert alone == pytest.approx(0.02), "each gets the constant of the other"
    assert other == pytest.approx(0.01), "the mean of both"
    once = dataset(("slow",), 2)
    speed = np.where(once["recording"] == "slow0", 0.01, 0.03).astype(np.float32)
    own = labelled(Dataset({**once.columns, "velocity_y": speed}, once.card), "estimate")
    assert severity.baselines(own, own)[1]["mae"] == pytest.approx(0.02), "each recording what the other does"


def test_frames_without_an_answer_are_reported():
    data = dataset(("a", "b"), 2)
    own = task(data, Model("field-mlp").build(HOST))
    assert own.answered == pytest.approx(79 / 80), "v_net of the first frame is undefined"
    assert labelled(data, "detect").answered == 1
    right = own.y.astype(float)
    row = detection.scored(own, right)
    assert row["accuracy"] == row["accuracy_all"] == 1, "the first frames rest, and unanswered is taken as rest"
    slips = Dataset({**data.columns, "slip": np.ones(len(data), np.int8)}, data.card)
    row = detection.scored(task(slips, Model("field-mlp").build(HOST)), np.ones(len(right)))
    assert row["accuracy"] == 1
    assert row["accuracy_all"] == pytest.approx(79 / 80)


def test_conformal_factors_make_ninety_per_cent():
    rng = np.random.default_rng(0)
    data = dataset()
    own = task(data, Model("linear-window").build(HOST))
    count = len(own.rows)
    true = np.column_stack([own.y, severity.true_speed(own)])
    std = rng.uniform(0.5, 2.0, (count, 4))
    predicted = np.hstack([true + std * rng.standard_normal((count, 4)), std])
    factors = severity.calibration(own, predicted)
    for each in factors:
        assert each == pytest.approx((1.645,) * 4, rel=0.2)
    inside = np.abs(predicted[:, :4] - true) <= factors.half_widths(predicted)
    assert inside.mean(axis=0) == pytest.approx([0.9] * 4, abs=0.03)


def test_what_moves_has_intervals_of_its_own_and_no_part_of_a_velocity_is_promised_to_be_exact():
    rng = np.random.default_rng(0)
    moves = rng.random(4000) < 0.2
    true = np.zeros((4000, 4))
    true[moves, 1] = true[moves, 3] = 0.04
    # Exact across the slide, ten times as wrong where it moves as where it rests, and the same width for both.
    wrong = np.where(moves, 1e-2, 1e-3) * rng.standard_normal(4000)
    predicted = np.hstack([true, np.full((4000, 4), 1e-3)])
    predicted[:, 1] += wrong
    predicted[:, 3] = np.abs(predicted[:, 3] + wrong)
    factors = conformal(true, predicted)
    half = factors.half_widths(predicted)
    assert factors.rest[0] == factors.rest[1]
    assert factors.moving[0] == factors.moving[1] > 5 * factors.rest[1]
    for which in (moves, ~moves):
        assert (np.abs(predicted[which, 3] - true[which, 3]) <= half[which, 3]).mean() == pytest.approx(0.9, abs=0.03)


def test_a_model_is_written_with_a_card_that_names_its_origin(tmp_path):
    card = train(dataset(), Model("logistic"), HOST, tmp_path / "mine.onnx")
    loaded = load_model(tmp_path / "mine.onnx", "detect")
    assert loaded.card.signals == card.signals
    stored = json.loads((tmp_path / "mine.json").read_text())
    assert stored["trained_on"]["objects"] == list("abcdef")
    assert stored["figures_are"] == "simulated"
    assert stored["scores"]["accuracy"] > 0.85


def test_labels_that_never_change_teach_nothing(tmp_path):
    data = dataset()
    still = Dataset({**data.columns, "slip": np.zeros(len(data), np.int8)}, data.card)
    with pytest.raises(DataError, match="same label"):
        train(still, Model("logistic"), HOST, tmp_path / "mine.onnx")


def test_the_report_has_every_table_and_names_what_failed(tmp_path, monkeypatch):
    names = (*SEEN[:4], *UNSEEN)
    data = tmp_path / "out" / "data"
    for job, objects in (("detection", names), ("severity", names), ("pipe", ("pvc-pipe",))):
        own = dataset(objects, 2)
        Dataset(own.columns, study(job, 0, quick=True)).save(data / job)
    todo = [
        jobs.FitJob("cross-validation", "logistic", "", "object"),
        jobs.FitJob("cross-validation", "logistic", "", "frames"),
        jobs.FitJob("unseen", "logistic"),
        jobs.FitJob("leave-one-out", "linear-window"),
        jobs.FitJob("severity-unseen", "linear-window"),
        jobs.FitJob("unseen", "logistic", labels="shuffled"),
        jobs.FitJob("severity-unseen", "linear-window", control="nuisance"),
        jobs.FitJob("leave-one-out", "linear-window", "no-such-set"),
        *(
            jobs.FitJob(table, control="rules")
            for table in ("cross-validation", "unseen", "leave-one-out", "severity-unseen")
        ),
    ]

    def stopped(*_, **__):
        raise DataError("stopped before it collected")

    monkeypatch.setattr(measure, "planned", lambda quick: todo)
    ticks = []
    result = measure.measure(tmp_path / "out", quick=True, tick=lambda *step: ticks.append(step))
    assert ticks[-1] == ("fitting", len(todo), len(todo))
    monkeypatch.setattr(measure, "run", None)
    again = measure.measure(tmp_path / "out", quick=True, tick=lambda *step: None)
    assert again["rows"] == json.loads(json.dumps(result["rows"], default=float)), "what was fitted is not fitted again"
    with pytest.raises(DataError, match=r"was collected with another quick \(True\)"):
        measure.measure(tmp_path / "out", tick=lambda *step: None)
    shutil.rmtree(tmp_path / "out" / "data")
    monkeypatch.setattr(measure, "collect", stopped)
    with pytest.raises(DataError, match="stopped before it collected"):
        measure.measure(tmp_path / "out", quick=True, tick=lambda *step: None)
    (tmp_path / "data").mkdir()
    with pytest.raises(DataError, match="is not empty and not a reproduction"):
        measure.measure(tmp_path, quick=True, tick=lambda *step: None)
    (failed,) = result["failed"]
    assert "no-such-set" in failed["reason"]
    text = markdown(result)
    pipe = [row["model"] for row in result["rows"] if row["table"] == "pipe" and row["object"] == "all"]
    blind = "linear-window, nuisances only"
    assert sorted(pipe) == ["always zero", "constant in contact", "linear-window", blind]
    assert "logistic, labels shuffled" in text
    for part in ("simulated", "one-parameter rule", "majority", "always zero", "constant in contact", "Not measured"):
        assert part in text
    assert "91.8, 99.5, 98.1, 74.8, 99.5" not in text, "printed figures are shown for the paper's models only"
    plot_reproduction(tmp_path / "tables.png", result)
    assert (tmp_path / "tables.png").stat().st_size > 20_000


def test_what_is_planned_has_the_paper_s_models_and_the_controls():
    planned = jobs.planned(quick=False)
    assert len(set(map(str, planned))) == len(planned)
    kinds = {(job.table, job.learner, job.signals, job.split, job.labels, job.control) for job in planned}
    for learner in ("random-forest", "gradient-boosting"):
        for signals in ("baseline", "proposed", "combined"):
            assert ("cross-validation", learner, signals, "frames", "measured", "") in kinds
    for learner in ("lstm", "mlp"):
        for signals in ("baseline", "proposed", "combined"):
            assert ("leave-one-out", learner, signals, "", "measured", "") in kinds
    assert {job.labels for job in planned} == {"measured", "shuffled"}
    assert {job.control for job in planned} == {"", "nuisance", "rules"}
