"""The charts of learned models: every model has a score, a time and a place on the front or beneath it."""

import numpy as np
import pytest
from lsds_plugins.estimators.field import FieldOptions, speed_of
from lsds_research.collecting.objects import UNSEEN
from lsds_research.datasets import from_rows, joined
from lsds_research.studies.models import tradeoff
from lsds_research.studies.models.curve import LearningStudy
from lsds_research.studies.models.options import LearningOptions, TradeoffOptions
from research.frames import CONTEXT, HOST, observations

from lsds.cli.main import main
from lsds.errors import DataError
from lsds.models.signals import SIGNALS, signals_of

COLUMNS = ("residual_along", "residual_across", "rigid_speed", "rim_speed")


def recording(name, thing, seed, frames=60):
    rng = np.random.default_rng(seed)
    slip = (np.arange(frames) // 20) % 2 == 1
    speed = np.where(slip, 0.03, 0.0)
    signals = np.exp(0.3 * rng.standard_normal((frames, len(SIGNALS)))).astype(np.float32) * 1e-4
    signals[:, [SIGNALS.index("residual_along"), SIGNALS.index("v_net")]] += (0.01 * speed)[:, None]
    labels = {
        "slip": slip,
        "speed": speed,
        "velocity_x": 0 * speed,
        "velocity_y": speed,
        "angular_velocity_label": 0 * speed,
    }
    return from_rows(name, thing, "slip", 0.04 * np.arange(frames), signals, labels)


def test_columns_give_the_speed_that_the_untrained_estimator_returns():
    frames = observations(12)
    estimator = HOST.build("estimator", "field", {}, CONTEXT)
    speeds = [estimator.update(frame).speed_m_s for frame in frames]
    values = np.array([signals_of(frame)[[SIGNALS.index(name) for name in COLUMNS]] for frame in frames])
    known = np.flatnonzero(np.isfinite(values).all(axis=1))
    pairs = np.stack([values[known[:-1]], values[known[1:]]], axis=1)
    assert speed_of(pairs, FieldOptions().gain) == pytest.approx([speeds[k] for k in known[1:]], rel=1e-3, abs=1e-9)
    assert max(speeds[k] for k in known) > 0


@pytest.mark.parametrize(
    ("job", "name", "learner", "untrained"),
    [
        ("detect", "detectors", "logistic", {"threshold", "rigid-residual"}),
        ("estimate", "estimators", "linear-window", {"field"}),
    ],
)
def test_a_chart_has_every_model_scored_timed_and_ranked(tmp_path, monkeypatch, job, name, learner, untrained):
    things = ("can", "bottle", *UNSEEN[:2])
    parts = [recording(f"{thing}{k}", thing, 10 * i + k) for i, thing in enumerate(things) for k in range(2)]
    joined(parts, {"figures_are": "simulated"}).save(tmp_path / "data")
    monkeypatch.setattr(tradeoff, "_planned", lambda job: [(learner, {}), (learner, {"length": 2})])
    options = TradeoffOptions(data=str(tmp_path / "data"), most=500, repeats=1)
    result = tradeoff.TradeoffStudy(options, CONTEXT, job).run(lambda done, whole: None)
    assert {row["model"] for row in result.rows} == {learner, *untrained}
    assert all(row["update_us"] > 0 and row["low"] <= row["score"] <= row["high"] for row in result.rows)
    assert any(row["front"] for row in result.rows)
    best = max(result.rows, key=lambda row: row["score"])
    assert best["model"] == learner
    result.draw(tmp_path / "chart.png")
    assert (tmp_path / "chart.png").read_bytes()[:4] == b"\x89PNG"
    assert main(["study", name, "--data", str(tmp_path / "none")]) != 0


@pytest.mark.parametrize(
    ("learner", "score", "plain"),
    [
        ("logistic", "accuracy", "majority"),
        ("linear-window", "r2", "always zero"),
    ],
)
def test_a_learning_curve_has_every_count_and_what_knows_nothing(tmp_path, learner, score, plain):
    things = ("can", "bottle", "ruler", *UNSEEN[:2])
    parts = [recording(f"{thing}{k}", thing, 10 * i + k) for i, thing in enumerate(things) for k in range(2)]
    joined(parts, {"figures_are": "simulated"}).save(tmp_path / "data")
    joined([recording("pipe0", "pvc-pipe", 90), recording("can9", "can", 91)], {}).save(tmp_path / "other")
    options = LearningOptions(data=str(tmp_path / "data"), also=str(tmp_path / "other"), learners=[learner])
    result = LearningStudy(options, CONTEXT).run(lambda done, whole: None)
    fitted = [row for row in result.rows if row["model"] == learner]
    assert [(row["objects"], row["on"]) for row in fitted] == [(n, on) for n in (1, 2, 3) for on in ("unseen", "other")]
    known = {row["on"]: row[score] for row in result.rows if row["model"] == plain}
    assert fitted[-2][score] > known["unseen"]
    assert "simulated" in result.title
    result.draw(tmp_path / "curve.png")
    assert (tmp_path / "curve.png").read_bytes()[:4] == b"\x89PNG"


def test_a_learning_curve_refuses_what_it_cannot_compare(tmp_path):
    parts = [recording(thing, thing, i) for i, thing in enumerate(("can", UNSEEN[0]))]
    joined(parts, {}).save(tmp_path / "data")
    joined(parts[:1], {}).save(tmp_path / "other")
    for options, message in (
        ({"learners": ["logistic", "linear-window"]}, "must have one job"),
        ({"also": str(tmp_path / "other")}, "no object that is not in the training data"),
    ):
        with pytest.raises(DataError, match=message):
            LearningStudy(LearningOptions(data=str(tmp_path / "data"), **options), CONTEXT).run(
                lambda done, whole: None
            )
