"""The shipped models: each loads, fits its card, and has the same results in the cell as its file."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from lsds_plugins.models import model_path
from lsds_research import make_models as make
from lsds_research.collecting.objects import SEEN
from lsds_research.slips.folder import SHIPPED as LABELS
from lsds_research.slips.folder import scored_only
from lsds_research.slips.labels import read_labels
from research.frames import CONTEXT, HOST, observations
from tactile.imprinted import Motion, bumps, painted

from lsds.models.artefact import load
from lsds.models.intervals import NORMAL_90
from lsds.models.signals import Picker
from lsds.models.window import Window
from lsds.session.track import watch

SHIPPED = [
    *(("detect", name) for name in make.SHIPPED["detection"]),
    *(("estimate", name) for name in make.SHIPPED["severity"]),
]


@pytest.mark.parametrize(("job", "name"), SHIPPED)
def test_a_shipped_model_fits_its_card_and_the_script_that_trained_it(job, name):
    artefact = load(model_path(name, ""), job)
    card = artefact.card
    objects = set(card.trained_on["objects"])
    if name == "fused":
        assert (card.name, card.figures_are) == (name, "simulated and measured")
        assert (card.trained_on["learner"], card.threshold) == ("fused", make.FUSED_THRESHOLD)
        real = {video.split("__")[0] for video in read_labels(LABELS)}
        assert objects - set(SEEN) == real - scored_only(), "never of what it is scored on"
    else:
        assert (card.name, card.figures_are) == (name, "simulated")
        assert card.trained_on["learner"] == name
        assert objects == set(SEEN), "never of what it is scored on"
    of = make.learns_from("detection" if job == "detect" else "severity", name)
    assert set(card.trained_on["datasets"]) == set(of)
    score = card.scores["accuracy"] if job == "detect" else card.scores["r2"]
    assert 0.5 < score < 1
    for factors in card.factors:
        assert all(0.05 <= factor < 6 for factor in factors), "an interval is neither nothing nor everything"
        assert factors[0] == factors[1]
    output = artefact.run(np.zeros((3, card.length, len(card.signals)), np.float32))
    assert np.isfinite(output).all()
    assert np.ptp(output, axis=0).max() == 0


# The made-up observations show no imprint.
@pytest.mark.parametrize(("job", "name"), [each for each in SHIPPED if each[1] not in make.OWN])
def test_a_shipped_model_has_the_results_of_its_file_in_the_cell(job, name):
    artefact = load(model_path(name, ""), job)
    running = HOST.build("detector" if job == "detect" else "estimator", name, {}, CONTEXT)
    window, pick = Window(artefact.card.length, len(artefact.card.signals)), Picker(artefact.card.signals)
    answered = 0
    for observation in observations(12):
        result, picked = running.update(observation), pick(observation)
        if picked is None:
            continue
        window.push(picked)
        answered += 1
        output = artefact.run(window.frames.copy()).reshape(-1)
        if job == "detect":
            assert result.score == pytest.approx(output[0], abs=1e-5)
        else:
            assert result.speed_m_s == pytest.approx(output[3], abs=1e-5)
            width = artefact.card.factors.half_widths(output[None])[0, 3]
            assert result.speed_std_m_s == pytest.approx(width / NORMAL_90, rel=1e-4)
    assert answered >= 10


@pytest.mark.parametrize(("job", "name"), SHIPPED)
def test_a_shipped_card_names_its_real_frames(job, name):
    card = load(model_path(name, ""), job).card
    assert card.real, f"python -m {make.__name__} --real FOLDER"
    learnt = card.real["fitted_on"]
    assert (learnt["frames"] > 0) == (len(learnt["recordings"]) > 0) == ("labelled" in card.trained_on["datasets"])
    assert not {video.split("__")[0] for video in learnt["recordings"]} & scored_only(), "never of what it is scored on"
    if job == "detect":
        assert set(card.real["scored_on"]["objects"]) == scored_only()
        scores = card.real["scores"]
        assert all(0 <= scores[key] <= 1 for key in ("found", "noticed", "answered"))
        assert all(0 <= scores[f"false_alarms_per_100_{kind}"] <= 100 for kind in ("moving", "still"))


def test_fused_has_the_results_of_its_file_on_a_recording(tmp_path):
    for number in range(12):
        image = painted(bumps(), Motion(1.5 * number), Motion(0.5 * number), seq=number).image
        cv2.imwrite(str(tmp_path / f"{number:02}.png"), image[..., ::-1])
    artefact = load(model_path("fused", ""), "detect")
    window, pick = Window(artefact.card.length, len(artefact.card.signals)), Picker(artefact.card.signals)
    answered = 0
    for cycle in watch(tmp_path, overrides=["detector.backend=fused", "tactile.reference_frames=1"]):
        picked = pick(cycle.observation)
        if picked is None:
            assert cycle.detection.slip is None
            continue
        window.push(picked)
        answered += 1
        assert cycle.detection.probability == pytest.approx(artefact.run(window.frames.copy()).reshape(-1)[0], abs=1e-5)
    assert answered >= 9
