"""Detector and estimator `imprint`, and the uncertainty of an imprint's motion, on motions that are known exactly."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_plugins.detectors.imprint import ImprintDetector, ImprintDetectorOptions
from lsds_plugins.estimators.fused import LEAST_MODEL_STD, FusedEstimator, FusedOptions
from lsds_plugins.estimators.imprint import ImprintEstimator, ImprintOptions
from tactile.scenes import observation

from lsds.clock import VirtualClock
from lsds.contracts import ABSTAINED, BuildContext, SlipEstimate
from lsds.tactile.imprint.motion import RECENT, ImprintMotion
from lsds.tactile.imprint.uncertainty import PRIOR_STD_M, covariance, distance, drift, step_m

CONTEXT = BuildContext(VirtualClock(), 0)
#: Information of an imprint that determines every direction well, 1/m^2 and 1.
WELL = (2e9, 2e9, 2e9 * 4e-3**2)
MM = 1e-3
DT_S = 0.04


def motion(x_mm=0.0, y_mm=0.0, turn_deg=0.0, *, known=WELL, dots_mm=0.0, **changes):
    """Return an imprint's motion against the gel, with edges at a radius of gyration of 4 mm."""
    made = ImprintMotion(
        slip_m=(x_mm * MM, y_mm * MM),
        turn_rad=math.radians(turn_deg),
        gel_m=(0.0, 0.0),
        dots_m=dots_mm * MM,
        centre_m=(0.0, 0.0),
        information=np.diag(known) if np.ndim(known) == 1 else known,
        match=0.95,
        stuck_match=0.9,
        seen=1.0,
        gain=1.0,
        strength=0.03,
        residual=0.005,
        grown=1.0,
        radius_m=4 * MM,
    )
    return dataclasses.replace(made, **changes)


class Followed:
    """An `Imprint` with those motions, the newest first; None is an unknown motion."""

    def __init__(self, *motions):
        self._motions = motions

    def __call__(self):
        return self._motions[0]

    def recent(self):
        return [each for each in self._motions if each is not None] if self._motions[0] is not None else []


def seen(*motions, dt_s=DT_S):
    return dataclasses.replace(observation(None, dt_s=dt_s), imprint=Followed(*motions))


def detect(*motions, **options):
    return ImprintDetector(ImprintDetectorOptions(**options), CONTEXT).update(seen(*motions))


def estimate(*motions, dt_s=DT_S, **options):
    return ImprintEstimator(ImprintOptions(**options), CONTEXT).update(seen(*motions, dt_s=dt_s))


part = st.floats(-0.5, 0.5).filter(lambda value: value == 0 or abs(value) > 1e-6)
turns = st.floats(-5, 5)
angles = st.floats(-math.pi, math.pi)


# -- how sure it is ----------------------------------------------------------------------------------------


@given(
    st.lists(st.floats(0, 1e10), min_size=3, max_size=3),
    st.floats(0, 0.1),
    st.floats(0, 2),
    st.floats(0, 1),
    st.booleans(),
)
def test_a_covariance_is_one_and_less_knowledge_never_makes_it_smaller(known, residual, dots, share, redrawn):
    base = motion(known=(known[0], known[1], known[2] * 1.6e-5), residual=residual, dots_mm=dots, redrawn=redrawn)
    spread = covariance(base, share)
    assert np.allclose(spread, spread.T, rtol=1e-9, atol=0)
    assert (np.linalg.eigvalsh(spread) > 0).all()
    worse = (
        dataclasses.replace(base, residual=residual + 0.01),
        dataclasses.replace(base, dots_m=base.dots_m + MM),
        dataclasses.replace(base, redrawn=True),
        dataclasses.replace(base, information=base.information / 2),
    )
    for other in worse:
        assert (np.diag(covariance(other, share)) >= np.diag(spread) * (1 - 1e-9)).all()


def test_along_an_edge_nothing_is_known_but_that_no_slip_is_huge():
    across, along = np.sqrt(np.diag(covariance(motion(known=(WELL[0], 0.0, WELL[2])))))[:2]
    assert along == pytest.approx(PRIOR_STD_M, rel=0.01)
    assert across < 0.05 * along


def test_the_dots_motion_is_in_doubt_by_the_share_and_a_key_frame_by_a_pixel():
    quiet, carried, redrawn = (
        math.sqrt(covariance(each, 0.2)[0, 0]) for each in (motion(), motion(dots_mm=1.0), motion(redrawn=True))
    )
    assert math.sqrt(carried**2 - quiet**2) == pytest.approx(0.2 * MM, rel=1e-6)
    assert math.sqrt(redrawn**2 - quiet**2) == pytest.approx(6e-5, rel=1e-6)
    assert math.sqrt(covariance(motion(dots_mm=1.0), 0.0)[0, 0]) == pytest.approx(quiet)


def test_the_turn_is_in_doubt_by_what_moves_the_edges_that_far():
    quiet, carried = (covariance(each, 0.2)[2, 2] for each in (motion(), motion(dots_mm=1.0)))
    assert math.sqrt(carried - quiet) * 4 * MM == pytest.approx(0.2 * MM, rel=1e-6)


@given(part, part, turns, angles, st.floats(0, 1))
def test_the_distance_is_the_same_however_the_sensor_is_turned(x, y, turn, angle, dots):
    cos, sin = math.cos(angle), math.sin(angle)
    about = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    known = np.diag((2e9, 3e7, 1e4))
    whole = motion(x, y, turn, known=known, dots_mm=dots)
    turned = motion(cos * x - sin * y, sin * x + cos * y, turn, known=about @ known @ about.T, dots_mm=dots)
    assert distance(turned) == pytest.approx(distance(whole), rel=1e-6, abs=1e-9)
    assert step_m(turned) == pytest.approx(step_m(whole), rel=1e-6, abs=1e-12)


@given(part, part, turns, st.floats(0, 3))
def test_distance_and_step_grow_in_proportion_to_the_motion(x, y, turn, times):
    one, more = motion(x, y, turn), motion(times * x, times * y, times * turn)
    assert distance(more) == pytest.approx(times * distance(one), rel=1e-6, abs=1e-9)
    assert step_m(more) == pytest.approx(times * step_m(one), rel=1e-6, abs=1e-12)
    assert distance(motion()) == step_m(motion()) == 0


def test_a_step_is_that_of_the_edges():
    assert step_m(motion(0.3, -0.4)) == pytest.approx(0.5 * MM)
    assert step_m(motion(turn_deg=2.0)) == pytest.approx(math.radians(2.0) * 4 * MM)
    assert distance(motion(0.2, dots_mm=1.0), 0.2) < 1.1 < distance(motion(0.2, dots_mm=1.0), 0.02)


# -- drift -------------------------------------------------------------------------------------------------


@given(part, part, turns)
def test_a_steady_slide_leads_as_far_as_its_steps_together(x, y, turn):
    deviations, moved = drift([motion(x, y, turn)] * RECENT)
    assert moved == pytest.approx(RECENT * step_m(motion(x, y, turn)), rel=1e-6, abs=1e-12)
    # The errors of the steps are independent, and a median is a little worse than a mean.
    assert deviations == pytest.approx(
        distance(motion(x, y, turn)) * math.sqrt(RECENT * 2 / math.pi), rel=1e-6, abs=1e-9
    )


@given(part, part)
def test_to_and_fro_and_a_slip_that_is_over_lead_nowhere(x, y):
    to, fro, still = motion(x, y), motion(-x, -y), motion()
    assert drift([to, fro, to, fro]) == pytest.approx((0, 0), abs=1e-9)
    assert drift([still, still, still, motion(20 * x, 20 * y)]) == pytest.approx((0, 0), abs=1e-9)


def test_a_slow_slide_that_no_frame_shows_is_found_by_four():
    slow = motion(0.03)
    assert distance(slow) < drift([slow] * RECENT)[0]


def test_too_few_frames_and_one_in_which_the_imprint_was_lost_lead_nowhere():
    slide = motion(0.3)
    assert drift([]) == drift([slide] * (RECENT - 1)) == (0.0, 0.0)
    lost = dataclasses.replace(slide, match=0.4)
    assert drift([slide, slide, lost, slide]) == (0.0, 0.0)
    assert drift([slide, slide, lost, slide], least_match=0.3)[0] > 0


# -- the detector ------------------------------------------------------------------------------------------


@given(part, part, turns, st.floats(0, 2))
def test_the_score_is_never_less_for_a_longer_slip(x, y, turn, dots):
    short, far = (detect(motion(f * x, f * y, f * turn, dots_mm=dots)) for f in (0.5, 1.0))
    assert far.score >= short.score - 1e-9
    for answer in (short, far):
        assert answer.slip == (answer.score > answer.threshold)
        assert 0 <= answer.confidence <= 1


def test_a_slide_is_slip_and_the_same_motion_under_a_gel_that_moves_much_is_not():
    assert detect(motion(0.3)).slip is True
    assert detect(motion(turn_deg=3.0)).slip is True
    assert detect(motion(0.3, dots_mm=3.0)).slip is False
    assert detect(motion(0.3, dots_mm=3.0), gel_share=0.01).slip is True
    assert detect(motion()).slip is False
    assert detect(motion(), threshold=1.0).threshold == 1.0


def test_motion_along_an_edge_is_no_evidence():
    along = motion(0.0, 0.3, known=(WELL[0], 0.0, WELL[2]))
    assert detect(along).slip is False
    assert detect(motion(0.3, 0.0, known=(WELL[0], 0.0, WELL[2]))).slip is True


def test_less_than_the_least_motion_counts_less():
    sure = motion(0.02, known=(1e13, 1e13, 1e9), residual=0.0)
    plain, damped = detect(sure, least_mm=0.0), detect(sure, least_mm=0.04)
    assert damped.score == pytest.approx(plain.score / 2)
    assert plain.score == pytest.approx(distance(sure))


def test_a_slow_slide_is_found_once_it_goes_on():
    slow = motion(0.03)
    assert detect(slow).slip is False
    assert detect(*[slow] * RECENT).slip is True
    fro = motion(-0.03)
    assert detect(slow, fro, slow, fro).slip is False


def test_an_imprint_that_was_lost_is_slip_where_it_is_as_strong_as_before():
    lost = motion(0.01, match=0.3)
    answer = detect(lost)
    assert answer.slip is True
    assert answer.confidence == 0.5
    for grown in (3.0, 0.2, 0.0):
        begun = detect(dataclasses.replace(lost, grown=grown))
        assert begun.slip is None, "a contact has begun or ended"
        assert math.isnan(begun.score)
        assert begun.confidence == 0
    assert detect(lost, least_match=0.2).slip is False


def test_the_detector_abstains_where_nothing_is_known():
    for unknown in (seen(None), observation(None)):
        answer = ImprintDetector(ImprintDetectorOptions(), CONTEXT).update(unknown)
        assert answer.slip is None
        assert math.isnan(answer.score)
        assert answer.confidence == 0


def test_the_detector_has_no_memory_of_its_own():
    used = ImprintDetector(ImprintDetectorOptions(), CONTEXT)
    used.update(seen(motion(1.0)))
    again = used.update(seen(motion(0.1)))
    used.reset()
    assert again == used.update(seen(motion(0.1))) == detect(motion(0.1))


# -- the estimator -----------------------------------------------------------------------------------------


@given(part, part, turns, st.floats(0.005, 0.5), st.floats(0, 1))
def test_the_velocity_is_the_motion_by_the_measured_interval(x, y, turn, dt_s, dots):
    moved = motion(x, y, turn, known=(2e9, 3e7, 1e4), dots_mm=dots)
    answer = estimate(moved, dt_s=dt_s)
    assert not answer.abstained
    assert answer.velocity_m_s == pytest.approx((x * MM / dt_s, y * MM / dt_s))
    assert answer.angular_rad_s == pytest.approx(math.radians(turn) / dt_s)
    assert answer.speed_m_s == pytest.approx(math.hypot(x, y) * MM / dt_s)
    spread = np.sqrt(np.diag(covariance(moved))) / dt_s
    assert [*answer.velocity_std_m_s, answer.angular_std_rad_s] == pytest.approx(spread.tolist())
    low, high = np.sqrt(np.linalg.eigvalsh(covariance(moved)[:2, :2])) / dt_s
    assert low * (1 - 1e-9) <= answer.speed_std_m_s <= high * (1 + 1e-9)


def test_the_speed_is_as_sure_as_the_direction_of_the_slip():
    known = (WELL[0], 0.0, WELL[2])
    across, along = estimate(motion(0.3, 0.0, known=known)), estimate(motion(0.0, 0.3, known=known))
    assert across.speed_std_m_s == pytest.approx(across.velocity_std_m_s[0])
    assert along.speed_std_m_s == pytest.approx(along.velocity_std_m_s[1])
    assert along.speed_std_m_s > 10 * across.speed_std_m_s
    still = estimate(motion(known=known))
    assert still.speed_m_s == 0
    assert still.speed_std_m_s == pytest.approx(math.sqrt(np.mean(np.square(still.velocity_std_m_s))))


@pytest.mark.parametrize("dt_s", [0.0, math.nan, -0.04])
def test_the_estimator_abstains_without_an_interval(dt_s):
    assert estimate(motion(0.3), dt_s=dt_s).abstained


def test_the_estimator_abstains_where_the_imprint_is_not_found_again():
    assert estimate(None).abstained
    assert ImprintEstimator(ImprintOptions(), CONTEXT).update(observation(None)).abstained
    answer = estimate(motion(0.3, match=0.5))
    assert answer.abstained
    assert math.isnan(answer.speed_m_s)
    assert not estimate(motion(0.3, match=0.5), least_match=0.4).abstained


def test_a_trained_model_alone_is_never_certain(monkeypatch):
    """Where a contact ends the imprint is unknown, and a model at rest states no error at all."""
    estimator = FusedEstimator(FusedOptions(), CONTEXT)
    certain = SlipEstimate((0.1, 0.0), (0.0, 1e-4), 0.0, 0.0, 0.1, 0.0)
    monkeypatch.setattr(estimator._model, "update", lambda observation: certain)
    found = estimator.update(SimpleNamespace(imprint=None, dt_s=0.04))
    assert found.velocity_m_s == certain.velocity_m_s
    assert (*found.velocity_std_m_s, found.angular_std_rad_s) == LEAST_MODEL_STD
    assert found.speed_std_m_s == LEAST_MODEL_STD[0]
    monkeypatch.setattr(estimator._model, "update", lambda observation: ABSTAINED)
    assert estimator.update(SimpleNamespace(imprint=None, dt_s=0.04)) is ABSTAINED
