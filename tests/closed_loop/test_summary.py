"""The figures of a run, on samples made by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from lsds.session.record import Sample
from lsds.session.summary import Slip, _called_slip, _detection, _severity_mae, _slip, _zero_mae

MS = 1_000_000


def sample(i, *, detected=True, speed=0.0, true=0.0):
    return Sample(40 * i * MS, "lift", True, True, 1.0, 0.2, detected, speed, 0.0, true, None, 0.02, 0.02)


def test_the_zero_predictor_is_judged_on_the_same_frames_as_the_estimator():
    """Abstaining on the hard frames must not make the estimator look better than saying zero."""
    samples = [sample(0, speed=0.01, true=0.02), sample(1, speed=math.nan, true=0.08), sample(2, true=0.0)]
    assert _severity_mae(samples) == pytest.approx(0.01 / 2)
    assert _zero_mae(samples) == pytest.approx(0.02 / 2)


def test_without_a_truth_there_is_no_error():
    samples = [sample(0, speed=0.01, true=math.nan)]
    assert _severity_mae(samples) is None
    assert _zero_mae(samples) is None
    assert _severity_mae([]) is None


def test_detections_are_counted_and_the_delay_is_from_slip_to_alarm():
    detected = [True, False, False, None, True, False]
    true = [0.0, 0.0, 0.02, 0.02, 0.02, 0.02]
    samples = [sample(i, detected=s, true=t) for i, (s, t) in enumerate(zip(detected, true, strict=True))]
    onset = Slip(0.001, (samples[2].t_ns - samples[0].t_ns) * 1e-9 - 0.01, 0.1, 0.02)
    counts = _detection(samples, samples[0].t_ns, onset)
    assert counts == {
        "true_positive": 1,
        "false_positive": 1,
        "true_negative": 1,
        "false_negative": 2,
        "abstained": 1,
        # From the true onset, 10 ms before the frame that shows it, to the alarm two frames later.
        "onset_delay_s": pytest.approx(0.09),
        "early_alarms": 1,
    }


def test_no_slip_has_no_onset():
    assert _slip([]) is None
    assert _detection([sample(0, detected=False)], 0, None)["onset_delay_s"] is None


def test_frames_called_slip_are_counted_since_the_lift_of_those_answered():
    before = replace(sample(0), acting=False, rising=False)
    samples = [
        before,
        *(sample(i, detected=detected) for i, detected in enumerate([True, False, None, False], start=1)),
    ]
    called = {"slip": 1, "answered": 3, "lifted": True, "slipped_m": None}
    assert _called_slip(samples, []) == called
    still = [replace(each, acting=False, rising=False) for each in samples]
    assert _called_slip(still, []) == {"slip": 2, "answered": 4, "lifted": False, "slipped_m": None}
    assert _called_slip([], []) is None


def test_an_alarm_is_a_frame_that_the_belief_calls_slip():
    """The belief notices slides of which the detector is not sure; where nothing is believed, the detector decides."""
    samples = [
        sample(0, detected=False),
        replace(sample(1, detected=True), slip_probability=0.1),
        replace(sample(2, detected=False, true=0.02), slip_probability=0.4),
        replace(sample(3, detected=False, true=0.02), slip_probability=0.9),
        replace(sample(4, detected=None, true=0.02), slip_probability=0.8),
        sample(5, detected=True, true=0.02),
    ]
    counts = _detection(samples, samples[0].t_ns, Slip(0.001, 0.08, None, 0.02))
    assert (counts["onset_delay_s"], counts["early_alarms"]) == (pytest.approx(0.04), 0)
    assert (counts["true_positive"], counts["false_negative"], counts["abstained"]) == (1, 2, 1)
    called = _called_slip(samples, [])
    assert (called["slip"], called["answered"]) == (3, 6)
