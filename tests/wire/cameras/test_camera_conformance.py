"""Camera drivers keep their contracts against the mocks that serve them."""

from __future__ import annotations

import pytest
from camera_rig import aruco, calibration, gelsight, markers, served, truth_camera

from lsds.testing import Bench, cases

GEL: dict = {}
DIGIT: dict = {"width": 240, "height": 320, "rate_hz": 25.0}
TRUTH: dict = {"markers": markers()}
GEL_CASES = cases(Bench("sensor", "gelsight-mini", GEL))
DIGIT_CASES = cases(Bench("sensor", "uvc-tactile", DIGIT))
TRUTH_CASES = cases(Bench("pose_source", "aruco", TRUTH))


@pytest.fixture(scope="module")
def gel():
    with served(gelsight(scene="slide")) as addresses:
        GEL["camera"] = DIGIT["camera"] = addresses["http"]
        yield


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    with served(truth_camera(rate_hz=30.0)) as addresses:
        TRUTH["camera"] = addresses["http"]
        TRUTH["calibration"] = str(calibration(tmp_path_factory.mktemp("calibration")))
        yield


@pytest.mark.parametrize("case", GEL_CASES, ids=lambda case: case.id)
def test_gelsight_mini(case, gel):
    case()


@pytest.mark.parametrize("case", DIGIT_CASES, ids=lambda case: case.id)
def test_uvc_tactile(case, gel):
    case()


@pytest.mark.parametrize("case", TRUTH_CASES, ids=lambda case: case.id)
def test_aruco(case, truth):
    case()


def test_bodies_are_where_they_are(truth):
    """Through rendering, JPEG, HTTP and detection: the gripper's marker stands where the scene puts it."""
    source = aruco(TRUTH["camera"], TRUTH["calibration"])
    source.connect()
    try:
        poses = source.read().poses
    finally:
        source.close()
    x, y, _ = poses["gripper"].position_m
    assert abs(x - 0.034) < 0.0005
    assert abs(y + 0.010) < 0.0015
    assert set(poses) == {"gripper", "object"}
    assert not source.counts.unknown
