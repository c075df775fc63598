"""The learner `fused`: boosted trees grown on histograms, the same in the exported model."""

from __future__ import annotations

import numpy as np
import onnxruntime
import pytest
from research.frames import CONTEXT, HOST
from research.synthetic import examples

from lsds.contracts.learning import Examples
from lsds.errors import ConfigError
from lsds.models.signals import SIGNAL_SETS


def learner(**options):
    return HOST.build("learner", "fused", {"n_estimators": 30, **options}, CONTEXT)


def session(fitted):
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    return onnxruntime.InferenceSession(fitted.export(), options, providers=["CPUExecutionProvider"])


def test_it_looks_at_three_frames_of_imprint_field_and_lost_markers():
    own = learner()
    assert (own.job, own.length) == ("detect", 3)
    assert own.signals == SIGNAL_SETS["imprint-field-and-lost"]


def test_it_distinguishes_a_slip_from_a_load_that_moves_the_gel_as_much():
    """Slip where the imprint moves against the gel, and not where only the dots do."""
    rng = np.random.default_rng(0)
    slips = rng.random(2000) < 0.3
    gel = rng.lognormal(np.log(1e-4), 1.0, 2000)
    imprint = np.where(slips, gel, 0.05 * gel) * rng.lognormal(0, 0.3, 2000)
    x = np.stack([imprint, gel], axis=1).astype(np.float32)[:, None, :]
    own = learner(signals=["imprint_step", "dots_step"], length=1)
    made = own.fit(Examples(x, slips.astype(np.float32), np.arange(2000) % 5), 0)
    assert np.mean((made.predict(x) > 0.5) == slips) > 0.97


def test_a_frame_that_counts_more_pulls_the_model_to_its_label():
    rng = np.random.default_rng(1)
    x = rng.standard_normal((600, 1, 1)).astype(np.float32)
    y = (np.arange(600) % 2).astype(np.float32)
    own = learner(signals=["imprint_step"], length=1)
    weight = np.where(y == 1, 9.0, 1.0).astype(np.float32)
    plain, heavy = (own.fit(Examples(x, y, np.arange(600) % 5, each), 0).predict(x).mean() for each in (None, weight))
    assert plain == pytest.approx(0.5, abs=0.05)
    assert heavy == pytest.approx(0.9, abs=0.05)


def test_zeros_and_huge_values_go_the_same_way_in_the_exported_model():
    own = learner()
    some = examples("detect", own.signals, own.length, 1500)
    made = own.fit(some, 0)
    shape = (1, own.length, len(own.signals))
    x = np.concatenate([np.full(shape, value, np.float32) for value in (0, 1e-30, 1e30, -1e30)])
    probability = session(made).run(None, {"x": x})[0]
    assert ((probability >= 0) & (probability <= 1)).all()
    assert probability == pytest.approx(made.predict(x), abs=1e-6)


def test_a_signal_on_a_threshold_goes_the_same_way():
    own = learner(signals=["imprint_step"], length=1)
    made = own.fit(examples("detect", own.signals, 1, 1500), 0)
    trees = [each.nodes for (each,) in made._model._predictors]
    limits = np.concatenate([nodes["num_threshold"][nodes["is_leaf"] == 0] for nodes in trees]).astype(np.float32)
    assert len(limits) > 20
    beside = [np.nextafter(limits, np.float32(side)) for side in (-np.inf, np.inf)]
    x = np.concatenate([limits, *beside])[:, None, None]
    assert np.abs(session(made).run(None, {"x": x})[0] - made.predict(x)).max() < 1e-6


@pytest.mark.parametrize("options", [{"max_depth": 0}, {"n_estimators": 0}, {"penalty": 1.0}])
def test_options_that_make_no_sense_are_refused(options):
    with pytest.raises(ConfigError):
        learner(**options)
