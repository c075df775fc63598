"""Results of algorithms are validated at the boundary, and the error names the algorithm."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lsds.contracts import ABSTAINED, Detection, MarkerTracks, SlipEstimate
from lsds.errors import PluginError
from lsds.safety.validation import validated_aperture, validated_detection, validated_estimate, validated_tracks

TRACKS = MarkerTracks(0, 7, np.zeros((3, 2)), np.array([True, True, False]), np.zeros(3, np.uint8))
ESTIMATE = SlipEstimate((0.0, 0.01), (0.001, 0.001), 0.0, 0.1, 0.01, 0.001)


def test_sound_answers_pass():
    lost = replace(TRACKS, xy_px=np.array([[0.0, 1.0], [2.0, 3.0], [math.nan, math.nan]]))
    assert validated_tracks("tracker 'x'", lost, 3, 7) is lost
    for slip in (True, None, np.bool_(False)):
        validated = validated_detection("detector 'x'", Detection(slip, 0.4, 0.5, 1.0), 7)
        assert validated.slip is (None if slip is None else bool(slip)), "fusion and controllers look for False itself"
    assert validated_detection("x", Detection(None, math.nan, math.nan, 0.0), 7).slip is None
    assert validated_estimate("estimator 'x'", ESTIMATE, 7) is ESTIMATE
    assert validated_estimate("estimator 'x'", ABSTAINED, 7) is ABSTAINED
    assert validated_aperture("x", None) is None
    assert validated_aperture("x", np.float32(0.5)) == 0.5


@pytest.mark.parametrize(
    ("look", "answer", "message"),
    [
        (validated_tracks, None, r"frame 7: update\(\) returned NoneType, not MarkerTracks"),
        (validated_tracks, replace(TRACKS, xy_px=np.zeros((2, 2))), r"\(2, 2\), \(3,\), \(3,\) for 3 markers"),
        (validated_tracks, replace(TRACKS, xy_px=np.full((3, 2), math.inf)), "no finite position"),
        (validated_tracks, replace(TRACKS, xy_px=np.full((3, 2), math.nan)), "no finite position"),
        (validated_detection, True, "returned bool, not Detection"),
        (validated_detection, Detection("yes", 1.0, 0.5, 1.0), "slip is 'yes'"),
        (validated_detection, Detection(True, math.nan, 0.5, 1.0), "score of a decision is NaN"),
        (validated_estimate, [0.0, 0.1], "returned list, not SlipEstimate"),
        (validated_estimate, replace(ESTIMATE, speed_m_s=math.nan), "NaN or infinite"),
        (validated_estimate, replace(ESTIMATE, velocity_m_s=(math.inf, 0.0)), "NaN or infinite"),
    ],
)
def test_a_wrong_result_is_an_error_that_names_the_algorithm_and_the_frame(look, answer, message):
    given = ("part 'x'", answer, 3, 7) if look is validated_tracks else ("part 'x'", answer, 7)
    with pytest.raises(PluginError, match=message) as raised:
        look(*given)
    assert "part 'x', frame 7" in str(raised.value)


@pytest.mark.parametrize("answer", ["closer", True, math.nan, -math.inf, [0.02]])
def test_a_controller_answers_a_number_or_none(answer):
    with pytest.raises(PluginError, match="controller 'x'"):
        validated_aperture("controller 'x'", answer)
