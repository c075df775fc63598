"""Every learner: what it exports gives what the training library gives, and the same seed gives the same model."""

from __future__ import annotations

import numpy as np
import onnx
import onnxruntime
import pytest
from lsds_research.learners.common import hold_out
from lsds_research.learners.compression import Compression
from lsds_research.learners.trees import _not_above
from research.frames import CONTEXT, HOST, LEAST
from research.synthetic import examples

from lsds.contracts.learning import Examples, Fitted, Learner
from lsds.errors import ConfigError, DataError

DETECTORS = ("random-forest", "gradient-boosting", "logistic", "field-mlp", "monotone", "fused")
ESTIMATORS = ("lstm", "mlp", "linear-window", "field-gru", "imprint-gru")
#: Enough to be no constant, little enough for a test.
QUICK = {
    "gradient-boosting": {"n_estimators": 20, "min_samples_split": 200},
    "field-mlp": {"epochs": 5},
    "mlp": {"epochs": 12},
    "lstm": {"epochs": 15, "batch": 128},
    "field-gru": {"epochs": 12},
    "imprint-gru": {"epochs": 12},
}
FITTED_ON, ROWS = 2500, 10_000


def learner(name, **options):
    return HOST.build("learner", name, {**QUICK.get(name, {}), **options}, CONTEXT)


def session(content):
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])


_fitted: dict[str, tuple[Learner, Fitted]] = {}


def fitted(name):
    if name not in _fitted:
        own = learner(name)
        _fitted[name] = own, own.fit(examples(own.job, own.signals, own.length, FITTED_ON), 3)
    return _fitted[name]


def test_the_learners_are_those_of_the_paper_and_ours():
    assert set(HOST.names("learner")) == {*DETECTORS, *ESTIMATORS}
    for name in (*DETECTORS, *ESTIMATORS):
        own = learner(name)
        assert isinstance(own, Learner)
        kind = "detector" if own.job == "detect" else "estimator"
        assert name in HOST.names(kind), "a learner bears the name of what runs its models"


@pytest.mark.parametrize("name", DETECTORS)
def test_ten_thousand_probabilities_and_labels_are_those_of_the_library(name):
    own, model = fitted(name)
    assert isinstance(model, Fitted)
    unseen = examples("detect", own.signals, own.length, ROWS, seed=8)
    library = model.predict(unseen.x)
    run = session(model.export()).run(None, {"x": unseen.x})[0]
    assert run.shape == library.shape == (ROWS,)
    assert run.dtype == library.dtype == np.float32
    assert np.abs(run - library).max() <= 1e-5
    assert np.count_nonzero((run > 0.5) != (library > 0.5)) == 0
    assert np.mean((run > 0.5) == unseen.y) > 0.85, "equality is worth nothing where nothing was learnt"
    one_by_one = session(model.export())
    alone = [one_by_one.run(None, {"x": unseen.x[i : i + 1]})[0][0] for i in range(100)]
    assert alone == pytest.approx(run[:100], abs=1e-6)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_ten_thousand_estimates_are_those_of_the_library(name):
    own, model = fitted(name)
    unseen = examples("estimate", own.signals, own.length, ROWS, seed=8)
    library = model.predict(unseen.x)
    run = session(model.export()).run(None, {"x": unseen.x})[0]
    assert run.shape == library.shape == (ROWS, 8)
    assert run.dtype == library.dtype == np.float32
    assert np.abs(run - library).max(axis=0).tolist() == pytest.approx([0.0] * 8, abs=1e-5)
    assert (run[:, 3] >= 0).all()
    assert (run[:, 4:] > 0).all()
    true = np.hypot(unseen.y[:, 0], unseen.y[:, 1])
    assert np.abs(run[:, 3] - true).mean() < 0.8 * true.mean(), "better than always zero"
    covered = np.mean(np.abs(run[:, 3] - true) <= 1.645 * run[:, 7])
    assert 0.6 < covered < 1.0, "the deviations are of the size of the errors"


@pytest.mark.parametrize("name", [*DETECTORS, *ESTIMATORS])
def test_the_same_seed_gives_the_same_model(name):
    own = learner(name, **LEAST.get(name, {}))
    few = examples(own.job, own.signals, own.length, 600)
    first, again = own.fit(few, 5), own.fit(few, 5)
    assert first.export() == again.export()
    assert np.array_equal(first.predict(few.x), again.predict(few.x))
    assert first.export() == first.export()


@pytest.mark.parametrize("name", ["random-forest", "mlp", "field-gru"])
def test_another_seed_gives_another_model(name):
    own = learner(name, **LEAST[name])
    few = examples(own.job, own.signals, own.length, 600)
    assert own.fit(few, 5).export() != own.fit(few, 6).export()


def test_training_leaves_torchs_generator_and_threads_alone():
    import torch

    own = learner("mlp", epochs=1)
    few = examples("estimate", own.signals, own.length, 300)
    torch.manual_seed(1)
    before, threads = torch.random.get_rng_state(), torch.get_num_threads()
    own.fit(few, 5).predict(few.x)
    assert torch.equal(before, torch.random.get_rng_state())
    assert torch.get_num_threads() == threads


@pytest.mark.parametrize("name", ["random-forest", "gradient-boosting"])
def test_a_signal_on_a_threshold_goes_the_same_way(name):
    own, model = fitted(name)
    limits = np.concatenate([e.tree_.threshold[e.tree_.feature == 0] for e in np.ravel(model._model.estimators_)])
    limits = limits.astype(np.float32)[:2000]
    x = examples("detect", own.signals, own.length, len(limits) * 3, seed=2).x
    beside = [np.nextafter(limits, np.float32(s)) for s in (-np.inf, np.inf)]
    x[:, 0, 0] = np.concatenate([limits, *beside])
    run = session(model.export()).run(None, {"x": x})[0]
    assert np.abs(run - model.predict(x)).max() < 1e-6


def test_the_exported_threshold_is_the_largest_float32_not_above():
    exact = np.array([0.1, 1 / 3, -0.1, 1e-9, 3.0, -1e30])
    found = _not_above(exact)
    assert (found.astype(float) <= exact).all()
    assert (np.nextafter(found, np.float32(np.inf)).astype(float) > exact).all()


def test_a_tree_that_is_one_leaf_is_exported():
    own = learner("random-forest", min_samples_leaf=400, n_estimators=3)
    few = examples("detect", own.signals, own.length, 600)
    model = own.fit(few, 0)
    assert {e.tree_.node_count for e in model._model.estimators_} == {1}
    run = session(model.export()).run(None, {"x": few.x})[0]
    assert run == pytest.approx(model.predict(few.x), abs=1e-6)


@pytest.mark.parametrize("name", [*DETECTORS, *ESTIMATORS])
def test_signals_and_length_can_be_chosen(name):
    own = learner(name, signals=["v_net", "area", "shear"], length=3, **LEAST.get(name, {}))
    few = examples(own.job, own.signals, 3, 400)
    assert few.x.shape[1:] == (3, 3)
    model = own.fit(few, 0)
    content = model.export()
    assert np.abs(session(content).run(None, {"x": few.x})[0] - model.predict(few.x)).max() < 1e-5
    onnx.checker.check_model(onnx.load_from_string(content), full_check=True)


@pytest.mark.parametrize("name", ["logistic", "lstm"])
def test_options_that_make_no_sense_are_one_clear_error(name):
    for options in ({"length": 0}, {"signal": "field"}, {"length": True}):
        with pytest.raises(ConfigError):
            learner(name, **options)
    with pytest.raises(DataError, match=r"unknown set of signals 'feild'; known sets: .*field"):
        learner(name, signals="feild")
    with pytest.raises(DataError, match=r"unknown signal v_nett; known signals:"):
        learner(name, signals=["v_nett"])
    with pytest.raises(DataError, match="exactly once, got: v_net, v_net"):
        learner(name, signals=["v_net", "v_net"])


@pytest.mark.parametrize("name", [*DETECTORS, *ESTIMATORS])
def test_examples_that_nothing_can_be_learnt_from_are_one_clear_error(name):
    own = learner(name)
    good = examples(own.job, own.signals, own.length, 300)

    def refused(match, x=good.x, y=good.y, group=good.group):
        with pytest.raises(DataError, match=match):
            own.fit(Examples(x, y, group), 0)

    bad = good.x.copy()
    bad[7, 0, 0] = np.nan
    refused("windows hold NaN", x=bad)
    wrong = good.y.copy()
    wrong[3] = np.inf
    refused("labels hold NaN", y=wrong)
    refused(r"windows are \(300,", x=good.x[:, :, 1:])
    refused("labels are", y=good.y[:10])
    refused("groups", group=good.group[:10])
    refused("too few", x=good.x[:10], y=good.y[:10], group=good.group[:10])
    if own.job == "detect":
        refused("both of them present", y=np.zeros_like(good.y))
        refused("0 and 1", y=good.y * 2)


def test_groups_are_held_out_whole():
    group = np.repeat(np.arange(9), np.arange(1, 10) * 10)
    for seed in range(20):
        held = hold_out(group, seed)
        assert not set(group[held]) & set(group[~held])
        assert held.any()
        assert not held.all()
        assert held.mean() >= 0.2
    alone = hold_out(np.zeros(50, int), 0)
    assert alone.sum() == 10
    assert alone[-10:].all()


def test_a_signal_that_never_changed_is_left_out():
    x = examples("detect", "field", 2, 500).x
    x[:, :, 3] = 7.0
    compression = Compression.fit(x)
    x[:, :, 3] = 1e6
    assert (compression(x)[:, :, 3] == 0).all()
    plain = Compression.fit(x, tails=False)(x)[:, -1]
    changing = np.arange(x.shape[2]) != 3
    assert plain.mean(axis=0) == pytest.approx(0, abs=1e-3)
    assert plain.std(axis=0)[changing] == pytest.approx(1, abs=1e-3)


def test_the_monotone_detector_never_scores_less_for_more():
    own = learner("monotone")
    rng = np.random.default_rng(0)
    made = examples("detect", own.signals, own.length, 3000)
    found = own.fit(made, 0)
    assert (found.weight >= 0).all()
    low = made.x[:500]
    high = low * (1 + rng.exponential(1.0, low.shape)).astype(np.float32)
    assert (found.predict(high) >= found.predict(low)).all()
