"""Poses and velocities of bodies from markers, and rejection of unreliable ones."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from camera_rig import CLOCK, HOST, aruco, calibration, outcomes, served, truth_camera
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_mocks.cell.build import build_cell
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.scene.cards import marker_card
from lsds_mocks.scene.lens import camera_model
from lsds_mocks.scene.painter import Painter
from lsds_mocks.scene.stage import DICTIONARY, FACING, MARKERS, VIEWPOINT, Stage, truth_pose
from motion_scenes import finder, in_base, slip_speeds, swinging

from lsds.calibration.vision.edges import refined_corners
from lsds.calibration.vision.fiducials import FiducialFinder, Marker
from lsds.calibration.vision.rotation import angle_between, quaternion_of, rotation_of
from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.contracts.plant_links import Scene
from lsds.errors import ConfigError, ConnectFailed

STAGE = Stage(640, 480, [1])
SMALL = Stage(160, 120, [1])
SCENE = Scene(0, 0.08, 0.02)
PICTURE = STAGE.render(SCENE, SCENE, 0)


def test_bodies_are_found_where_they_are():
    found = finder(STAGE).find(PICTURE, 0)
    for body in MARKERS:
        truth = np.array(truth_pose(SCENE, body).position_m)
        away = VIEWPOINT.rotation.T @ (in_base(found[body]) - truth)
        assert np.abs(away[:2]).max() < 0.0002
        assert abs(away[2]) < 0.0012
        assert angle_between(VIEWPOINT.rotation @ found[body].rotation, FACING) < np.deg2rad(1.0)
        assert found[body].error_px < 0.1


def test_corners_have_no_bias_from_blur():
    """By the sides within 0.06 px of the true projection; OpenCV's own corner search ends 0.2 px inside."""
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    grey = PICTURE[..., 1].copy()
    quads, numbers, _ = detector.detectMarkers(grey)
    for quad, number in zip(quads, numbers.reshape(-1).tolist(), strict=True):
        body = next(b for b, (n, _) in MARKERS.items() if n == number)
        rotation, position = VIEWPOINT.seen(FACING, np.array(truth_pose(SCENE, body).position_m))
        corners = Marker(MARKERS[body][1] * 1e-3).corners() @ rotation.T + position
        true, _ = cv2.projectPoints(corners, np.zeros(3), np.zeros(3), STAGE.camera.matrix, STAGE.camera.distortion)
        refined = refined_corners(grey, np.asarray(quad, float).reshape(4, 2))
        assert np.abs(refined - true.reshape(4, 2)).max() < 0.08


def test_corners_without_edges_stay_as_they_are():
    corners = np.array([(10.0, 10), (60, 10), (60, 60), (10, 60)])
    assert np.array_equal(refined_corners(np.full((80, 80), 90, np.uint8), corners), corners)
    assert np.array_equal(refined_corners(np.zeros((80, 80), np.uint8), corners * 0.1), corners * 0.1)


def test_slip_speed_is_within_a_millimetre_a_second_at_4_cm_s():
    found = slip_speeds(0.03)
    assert 100 * found.rms_m_s <= 0.06
    assert abs(100 * found.bias_m_s) < 0.02
    assert abs(found.lag_s - 0.03) < 0.005


def test_while_the_speed_changes_the_reported_lag_is_the_one_to_subtract():
    found = slip_speeds(0.03, swinging)
    assert found.rms_m_s < 0.4 * found.rms_without_lag_m_s
    assert 100 * found.rms_m_s < 0.1


def test_a_covered_marker_is_absent_and_the_other_stays():
    covered = PICTURE.copy()
    covered[240:300, 270:300] = 90  # a finger before the object's marker
    looking = finder(STAGE)
    assert set(looking.find(covered, 0)) == {"gripper"}
    assert set(looking.find(PICTURE, 1)) == {"gripper", "object"}
    assert looking.find(np.full_like(PICTURE, 120), 2) == {}


def test_unknown_markers_are_counted_and_not_believed():
    only = FiducialFinder(STAGE.camera, DICTIONARY, {"gripper": {0: Marker(0.036)}})
    assert set(only.find(PICTURE, 0)) == {"gripper"}
    only.find(PICTURE, 1)
    assert only.counts.unknown == {1: 2}


def test_a_marker_seen_twice_is_neither():
    doubled = np.hstack([PICTURE[:, :420], PICTURE[:, 200:420]])
    looking = FiducialFinder(camera_model(640, 480), DICTIONARY, {"gripper": {0: Marker(0.036)}})
    assert looking.find(np.ascontiguousarray(doubled), 0) == {}
    assert looking.counts.doubled == 1


def test_corners_that_fit_no_pose_are_no_body():
    sheared = cv2.warpAffine(PICTURE, np.array([[1.0, 0, 0], [0, 1, 0]]), (640, 480))
    wrong = {"both": {0: Marker(0.036), 1: Marker(0.036, (0.5, 0.0))}}
    looking = FiducialFinder(STAGE.camera, DICTIONARY, wrong)
    assert looking.find(sheared, 0) == {}
    assert looking.counts.rejected == 1


PAINTER = Painter(camera_model(640, 480))


def face_on(turn_deg, noise_seed):
    """A small marker far away and nearly face on, where two poses explain it."""
    card = marker_card(3, 24, dictionary=DICTIONARY, width_mm=36, height_mm=36, marker_at_mm=18)
    angle = np.deg2rad(turn_deg)
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    rotation = np.diag([1.0, -1.0, -1.0]) @ turn
    image = np.full((480, 640), 130, np.float32)
    PAINTER.paint(image, card, lambda share: (rotation, np.array([0.0, 0.0, 0.9])))
    noise = np.random.default_rng(noise_seed).normal(0, 2.5, image.shape)
    noisy = cv2.GaussianBlur(image, (0, 0), 0.6) + noise
    return np.clip(noisy, 0, 255).astype(np.uint8), rotation


def test_of_two_poses_the_one_that_goes_on_is_taken():
    """The marker turns slowly through face on; its orientation does not jump to the mirror pose."""
    camera = camera_model(640, 480)
    looking = FiducialFinder(camera, DICTIONARY, {"body": {3: Marker(0.024)}})
    worst = 0.0
    for number, turn in enumerate(np.linspace(35, 6, 30)):
        image, rotation = face_on(turn, number)
        found = looking.find(image, number * 16_000_000)["body"]
        worst = max(worst, angle_between(rotation, found.rotation))
    assert worst < np.deg2rad(25)
    assert looking.counts.ambiguous > 0


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_quaternions_and_matrices_are_the_same_rotation(parts):
    rotation = rotation_of(tuple(parts))
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
    assert np.allclose(rotation_of(quaternion_of(rotation)), rotation, atol=1e-9)
    assert abs(np.linalg.norm(quaternion_of(rotation)) - 1) < 1e-12


# -- the pose sources themselves --------------------------------------------------------------------------


def test_invalid_options_are_reported():
    for wrong, word in [
        ({"markers": []}, "none are named"),
        ({"dictionary": "5X5"}, "5X5_100"),
        ({"markers": [{"id": 1, "body": b, "size_mm": 30.0} for b in "ab"]}, "already on 'a'"),
        ({"camera_quaternion_xyzw": [0.0, 0.0, 0.0, 0.0]}, "no length"),
        ({"boards": [{"body": "x", "columns": 8, "rows": 6, "square_mm": 20.0, "marker_mm": 30.0}]}, "smaller"),
    ]:
        with pytest.raises(ConfigError, match=word):
            aruco("0", "camera.yaml", **wrong)
    with pytest.raises(ConfigError, match="lsds calibrate camera"):
        aruco("0", "")


def test_a_missing_calibration_is_reported_on_connect():
    source = aruco("http://127.0.0.1:9/", "nowhere.yaml")
    with pytest.raises(ConnectFailed, match="lsds calibrate camera"):
        source.connect()
    source.close()


def test_a_calibration_of_another_shape_is_reported_on_connect(tmp_path):
    with served(truth_camera(rate_hz=20.0)) as addresses:
        source = aruco(addresses["http"], calibration(tmp_path, 1280, 720), connect_timeout_s=0.7)
        with pytest.raises(ConnectFailed, match="calibrate at the size"):
            source.connect()
        source.close()


def test_a_video_is_played_at_its_own_pace_and_ends(tmp_path):
    clip = cv2.VideoWriter(str(tmp_path / "clip.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (640, 480))
    for number in range(12):
        clip.write(STAGE.render(SCENE, SCENE, number)[..., ::-1])
    clip.release()
    source = aruco(str(tmp_path / "clip.avi"), calibration(tmp_path), skip_frames=0)
    source.connect()
    begin = CLOCK.now()
    with pytest.raises(EOFError, match="has ended"):
        outcomes(source, 5.0)
    assert CLOCK.now() - begin > 200_000_000
    source.close()


def test_the_simulated_camera_sees_the_simulated_cell():
    context = BuildContext(VirtualClock(), 3)
    cell = build_cell(CellOptions(), context)
    camera = HOST.build("pose_source", "mock-truth-camera", {"latency_ms": 20.0}, context)
    camera.connect()
    cell.post(0, "arm", lambda plant: setattr(plant.arm, "target_m_s", 0.03))
    context.clock.sleep_until(1_000_000_000)
    sample = camera.read()
    # Where the gripper was when the picture was taken: 20 ms and up to a picture's interval ago.
    expected = cell.moment(sample.t_ns).arm_z_m + 0.06
    assert abs(sample.poses["gripper"].position_m[2] - expected) < 0.0003
    assert abs(sample.poses["object"].position_m[2] - 0.11) < 0.0003
    assert 20_000_000 <= context.clock.now() - sample.t_ns < 40_000_000
    camera.close()


@settings(max_examples=300)
@given(arm_m=st.floats(-0.05, 0.35), object_m=st.floats(-0.2, 0.35), moved_m=st.sampled_from([0.0, 4e-4]))
def test_cards_all_but_out_of_sight_are_painted_and_what_stood_still_looks_the_same(arm_m, object_m, moved_m):
    """Of a card at the picture's rim a single row may be left; a picture does not depend on the one before."""
    begin, end = Scene(0, arm_m, object_m), Scene(1, arm_m + moved_m, object_m)
    picture = SMALL.render(begin, end, 3)
    assert np.array_equal(SMALL.render(begin, end, 3), picture)
    assert np.array_equal(Stage(160, 120, [1]).render(begin, end, 3), picture)
