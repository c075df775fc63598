"""Learned detectors and estimators in the cell: the same as offline, abstaining, forgetting, without training code."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lsds_research.datasets import Dataset, from_rows
from lsds_research.windows import windows
from research.frames import CONTEXT, HOST, fit_and_save, observations
from research.synthetic import examples

from lsds.contracts import Detector, Estimator, FeatureVector
from lsds.errors import ConfigError, DataError, ModelError
from lsds.models.artefact import Card, load, save
from lsds.models.intervals import MOVES_M_S, NORMAL_90
from lsds.models.signals import Picker, signals_of
from lsds.models.window import Window

DETECTORS = ("random-forest", "gradient-boosting", "logistic", "field-mlp", "monotone")
ESTIMATORS = ("lstm", "mlp", "linear-window", "field-gru")
LOSE = (9, 10, 23)


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    return {name: fit_and_save(name, folder) for name in (*DETECTORS, *ESTIMATORS)}


@pytest.fixture(scope="module")
def seen():
    return observations(40, lose=LOSE)


def backend(models, name, **options):
    kind, path, _ = models[name]
    return HOST.build(kind, name, {"model": str(path), **options}, CONTEXT)


def offline(models, name, seen):
    """Return the training library's predictions for the recording's windows, and the last frame of each."""
    kind, path, fitted = models[name]
    card = load(path, "detect" if kind == "detector" else "estimate").card
    signals = np.array([signals_of(o) for o in seen])
    t_s = [o.t_ns * 1e-9 for o in seen]
    x, rows = windows(Dataset(from_rows("a", "b", "c", t_s, signals, {})), card.signals, card.length)
    return fitted.predict(x), rows


@pytest.mark.parametrize("name", DETECTORS)
def test_a_detector_has_the_library_s_scores_frame_by_frame(models, seen, name):
    detector = backend(models, name)
    assert isinstance(detector, Detector)
    predicted, rows = offline(models, name, seen)
    assert 25 < len(rows) < 40
    found = [detector.update(observation) for observation in seen]
    assert [i for i, detection in enumerate(found) if detection.slip is not None] == rows.tolist()
    assert [found[i].score for i in rows] == pytest.approx(predicted, abs=1e-5)
    for detection in found:
        if detection.slip is None:
            assert math.isnan(detection.score)
            assert detection.confidence == 0
        else:
            assert detection.slip == (detection.score > detection.threshold == 0.5)
            assert detection.confidence == pytest.approx(abs(2 * detection.score - 1))


@pytest.mark.parametrize("name", ESTIMATORS)
def test_an_estimator_has_the_library_s_results_frame_by_frame(models, seen, name):
    estimator = backend(models, name)
    assert isinstance(estimator, Estimator)
    predicted, rows = offline(models, name, seen)
    found = [estimator.update(observation) for observation in seen]
    assert [i for i, estimate in enumerate(found) if not estimate.abstained] == rows.tolist()
    for i, row in zip(rows, predicted, strict=True):
        e = found[i]
        numbers = (*e.velocity_m_s, e.angular_rad_s, e.speed_m_s)
        spreads = (*e.velocity_std_m_s, e.angular_std_rad_s, e.speed_std_m_s)
        assert numbers == pytest.approx(row[:4], abs=1e-5)
        assert spreads == pytest.approx(row[4:], abs=1e-5)
    assert all(math.isnan(e.speed_m_s) for e in found if e.abstained)


@pytest.mark.parametrize("name", ["logistic", "field-mlp", "lstm", "field-gru"])
def test_reset_forgets_the_past_and_nothing_else(models, seen, name):
    used, fresh = backend(models, name), backend(models, name)
    for observation in seen[:20]:
        used.update(observation)
    used.reset()
    assert [used.update(o) for o in seen[24:]] == [fresh.update(o) for o in seen[24:]]


def test_two_backends_of_one_model_do_not_share_a_past(models, seen):
    one, other, alone = (backend(models, "field-gru") for _ in range(3))
    for observation in seen[1:8]:
        one.update(observation)
    assert other.update(seen[12]) == alone.update(seen[12])


def test_the_threshold_is_configured_or_else_the_card_s(models, seen, tmp_path):
    _, path, _ = fit_and_save("logistic", tmp_path, threshold=0.8)
    carded = HOST.build("detector", "onnx", {"model": str(path)}, CONTEXT)
    configured = HOST.build("detector", "onnx", {"model": str(path), "threshold": 0.001}, CONTEXT)
    for observation in seen[1:9]:
        first, second = carded.update(observation), configured.update(observation)
        assert first.score == second.score
        assert (first.threshold, second.threshold) == (0.8, 0.001)
        assert second.slip == (second.score > 0.001)


def test_a_detector_abstains_below_the_configured_confidence(models, seen):
    plain = backend(models, "gradient-boosting").update(seen[1])
    confidence = plain.confidence
    assert 0 < confidence < 1
    for below, abstains in ((confidence * 0.99, False), (min(1.0, confidence * 1.01), True)):
        detection = backend(models, "gradient-boosting", abstain_below=below).update(seen[1])
        assert (detection.slip is None) == abstains
        assert (detection.score, detection.confidence) == (plain.score, confidence)


def test_an_estimator_abstains_above_the_configured_deviation_which_its_card_widens(seen, tmp_path):
    kind, path, _ = fit_and_save("linear-window", tmp_path, intervals=(1.645, 1.645, 1.645, 1.645))
    narrow = HOST.build(kind, "onnx", {"model": str(path)}, CONTEXT).update(seen[1])
    _, wide_path, _ = fit_and_save("linear-window", tmp_path, intervals=(3.29, 1.645, 1.645, 4.935))
    wide = HOST.build(kind, "onnx", {"model": str(wide_path)}, CONTEXT).update(seen[1])
    assert wide.speed_std_m_s == pytest.approx(3 * narrow.speed_std_m_s)
    assert wide.velocity_std_m_s == pytest.approx((2 * narrow.velocity_std_m_s[0], narrow.velocity_std_m_s[1]))
    assert wide.speed_m_s == narrow.speed_m_s
    for factor, abstains in ((0.99, True), (1.01, False)):
        limit = factor * wide.speed_std_m_s
        built = HOST.build(kind, "onnx", {"model": str(wide_path), "abstain_above_std_m_s": limit}, CONTEXT)
        assert built.update(seen[1]).abstained == abstains


def test_an_estimate_of_motion_has_the_intervals_of_moving_frames(seen, tmp_path):
    card = {"intervals": (NORMAL_90,) * 4, "moving_intervals": (3 * NORMAL_90,) * 4}
    kind, path, _ = fit_and_save("field-gru", tmp_path, **card)
    model, estimator = load(path, "estimate"), HOST.build(kind, "onnx", {"model": str(path)}, CONTEXT)
    window = Window(model.card.length, len(model.card.signals))
    pick, moves = Picker(model.card.signals), []
    for observation in seen:
        estimate, picked = estimator.update(observation), pick(observation)
        if picked is None:
            continue
        window.push(picked)
        output = model.run(window.frames.copy())
        moves.append(output[0, 3] > MOVES_M_S)
        widths = model.card.factors.half_widths(output)[0] / NORMAL_90
        found = (*estimate.velocity_std_m_s, estimate.angular_std_rad_s, estimate.speed_std_m_s)
        assert found == pytest.approx(widths, rel=1e-4)
    assert len(moves) > 3


def test_a_model_without_a_file_is_one_clear_error(tmp_path):
    for kind in ("detector", "estimator"):
        with pytest.raises(ModelError, match="no model is shipped for 'onnx': set the option model"):
            HOST.build(kind, "onnx", {}, CONTEXT)
        with pytest.raises(ModelError, match=r"nowhere\.onnx: cannot be read"):
            HOST.build(kind, "onnx", {"model": str(tmp_path / "nowhere.onnx")}, CONTEXT)


def test_options_that_make_no_sense_are_one_clear_error(models):
    for options in ({"threshold": 1.5}, {"abstain_below": -1}, {"treshold": 0.5}):
        with pytest.raises(ConfigError):
            backend(models, "logistic", **options)
    with pytest.raises(ConfigError):
        backend(models, "lstm", abstain_above_std_m_s=0)


def test_a_model_of_the_brightness_cannot_run_in_a_cell(tmp_path):
    learner = HOST.build("learner", "logistic", {"signals": "nuisance"}, CONTEXT)
    fitted = learner.fit(examples("detect", learner.signals, learner.length, 300), 0)
    save(tmp_path / "n.onnx", fitted.export(), Card("n", "detect", learner.signals, learner.length, "simulated"))
    with pytest.raises(ModelError, match=r"n\.onnx: cannot run in a cell: the brightness"):
        HOST.build("detector", "onnx", {"model": str(tmp_path / "n.onnx")}, CONTEXT)


def test_features_of_another_version_are_one_clear_error(models, seen):
    other = replace(seen[1], features=FeatureVector(("v_net",), np.zeros(1)))
    with pytest.raises(DataError, match="not those of this version"):
        backend(models, "logistic").update(other)
