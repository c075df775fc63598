"""The learner `fused`: a linear model on logarithms, so that what counts is by which factor a signal is larger."""

from __future__ import annotations

import numpy as np
import onnxruntime
import pytest
from lsds_research.learners.fused import FLOORS
from research.frames import CONTEXT, HOST
from research.synthetic import examples

from lsds.contracts.learning import Examples
from lsds.errors import ConfigError
from lsds.models.signals import SIGNAL_SETS, UNITS


def learner(**options):
    return HOST.build("learner", "fused", options, CONTEXT)


@pytest.fixture(scope="module")
def fitted():
    own = learner()
    return own.fit(examples("detect", own.signals, 1, 1500), 0)


def windows(own, rows=300, seed=5):
    return examples("detect", own.signals, own.length, rows, seed).x


def test_it_looks_at_one_frame_of_imprint_and_dots():
    own = learner()
    assert (own.job, own.length) == ("detect", 1)
    assert own.signals == SIGNAL_SETS["imprint-and-dots"]
    assert {UNITS[name] for name in own.signals} <= set(FLOORS), "each has a floor"


def test_the_sign_of_a_signal_does_not_matter(fitted):
    x = windows(learner())
    assert np.array_equal(fitted.predict(-x), fitted.predict(x))


def test_what_is_far_below_the_noise_is_as_nothing(fitted):
    own = learner()
    floor = np.array([FLOORS[UNITS[name]] for name in own.signals], np.float32)
    nothing = np.zeros((1, 1, len(floor)), np.float32)
    assert fitted.predict(nothing + 1e-4 * floor) == pytest.approx(fitted.predict(nothing), abs=1e-3)


def test_it_learns_a_ratio_of_two_signals():
    """Slip where the imprint moves more than the dots, whatever both do: no threshold on either tells it."""
    rng = np.random.default_rng(0)
    size = rng.lognormal(np.log(1e-3), 1.5, 2000)
    ratio = rng.lognormal(0, 1.0, 2000)
    x = np.stack([size * ratio, size], axis=1).astype(np.float32)[:, None, :]
    own = learner(signals=["imprint_step", "dots_step"])
    made = own.fit(Examples(x, (ratio > 1).astype(np.float32), np.arange(2000) % 5), 0)
    assert np.mean((made.predict(x) > 0.5) == (ratio > 1)) > 0.97
    assert made.weight[0] > 0 > made.weight[1]


def test_a_smaller_penalty_s_inverse_makes_smaller_weights():
    some = examples("detect", learner().signals, 1, 600)
    free, held = (learner(penalty=c).fit(some, 0) for c in (1.0, 1e-3))
    assert np.linalg.norm(held.weight) < 0.5 * np.linalg.norm(free.weight)


def test_the_seed_has_no_effect_for_nothing_is_drawn():
    own = learner()
    some = examples("detect", own.signals, 1, 400)
    assert own.fit(some, 1).export() == own.fit(some, 2).export()


def test_zeros_and_huge_values_are_finite_in_the_exported_model_too(fitted):
    own = learner()
    x = np.concatenate([np.full((1, 1, len(own.signals)), value, np.float32) for value in (0, 1e-30, 1e30, -1e30)])
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    run = onnxruntime.InferenceSession(fitted.export(), options, providers=["CPUExecutionProvider"])
    said = run.run(None, {"x": x})[0]
    assert ((said >= 0) & (said <= 1)).all()
    assert said == pytest.approx(fitted.predict(x), abs=1e-4)


@pytest.mark.parametrize("options", [{"penalty": 0.0}, {"penalty": -1.0}, {"penalties": 1.0}])
def test_options_that_make_no_sense_are_refused(options):
    with pytest.raises(ConfigError):
        learner(**options)
