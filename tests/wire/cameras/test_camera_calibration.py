"""`lsds calibrate camera` recovers a known camera, and refuses views that do not constrain it."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
from board_views import COLUMNS, DICTIONARY, MARKER_MM, ROWS, SQUARE_MM, Views
from camera_rig import served, time_camera

from lsds.calibration.vision.board_views import BoardFinder, calibrate
from lsds.calibration.vision.camera import CameraModel, load_camera, save_camera
from lsds.calibration.vision.fiducials import Board, FiducialFinder
from lsds.cli.main import main
from lsds.errors import DataError

BOARD = Board(COLUMNS, ROWS, SQUARE_MM * 1e-3, MARKER_MM * 1e-3)


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("views")
    for number, image in enumerate(Views().many(20)):
        cv2.imwrite(str(folder / f"view_{number:02}.png"), image[..., ::-1])
    return folder


def test_a_known_camera_is_found_again(pictures, tmp_path):
    out, plot, report = tmp_path / "camera.yaml", tmp_path / "coverage.png", tmp_path / "report.json"
    assert (
        main(["calibrate", "camera", str(pictures), "--out", str(out), "--plot", str(plot), "--json", str(report)]) == 0
    )
    truth, found = Views().camera, load_camera(out)
    assert np.abs(found.matrix[[0, 1], [0, 1]] / truth.matrix[[0, 1], [0, 1]] - 1).max() < 0.004
    assert np.abs(found.matrix[:2, 2] - truth.matrix[:2, 2]).max() < 3.0
    # The projected points have to agree, not the single coefficients.
    grid = np.array([(x, y, 1.0) for x in np.linspace(-0.45, 0.45, 9) for y in np.linspace(-0.32, 0.32, 7)])
    places = [cv2.projectPoints(grid, np.zeros(3), np.zeros(3), c.matrix, c.distortion)[0] for c in (truth, found)]
    assert np.abs(places[0] - places[1]).max() < 3.5
    result = json.loads(report.read_text())
    assert result["error_px"] < 0.2
    assert result["coverage"] > 0.7
    assert len(result["views"]) == result["pictures"] == 20
    assert cv2.imread(str(plot)).shape[0] > 300


def test_the_file_is_opencvs_and_comes_back(tmp_path):
    camera = CameraModel(np.array([[600.0, 0, 320], [0, 601, 240], [0, 0, 1]]), np.array([0.1, 0, 0, 0, 0]), (640, 480))
    for name in ("camera.yaml", "camera.json", "camera.xml"):
        save_camera(tmp_path / name, camera, {"nr_of_views": 9})
        storage = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_READ)
        assert np.array_equal(storage.getNode("camera_matrix").mat(), camera.matrix)
        storage.release()
        again = load_camera(tmp_path / name)
        assert np.array_equal(again.distortion, camera.distortion)
        assert again.size == camera.size


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (None, "does not exist"),
        ("", "neither YAML"),
        ("hello", "neither YAML"),
        ('{"a": 1}', "no 3 x 3 matrix"),
        ("%YAML:1.0\n---\ncamera_matrix: [1, 2]\n", "no 3 x 3 matrix"),
        ("{", "cannot be read|no 3 x 3"),
        (
            "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
            "   data: [ 600., 0., 320., 0., 600., 240., 0., 0., 1. ]\n",
            "image_width",
        ),
        (
            "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n"
            "   cols: 3\n   dt: d\n   data: [ -600., 0., 320., 0., 600., 240., 0., 0., 1. ]\n",
            "camera matrix is invalid",
        ),
    ],
)
def test_a_bad_file_is_reported_with_a_remedy(tmp_path, text, word):
    file = tmp_path / "camera.yaml"
    if text is not None:
        file.write_text(text)
    with pytest.raises(DataError, match=word) as raised:
        load_camera(file)
    assert "camera.yaml" in str(raised.value)
    assert "lsds calibrate camera" in str(raised.value)


def test_another_size_of_the_same_shape_is_scaled_and_another_shape_refused():
    camera = Views().camera
    half = camera.scaled((320, 240))
    point = np.array([[0.1, -0.05, 1.0]])
    whole, small = (
        cv2.projectPoints(point, np.zeros(3), np.zeros(3), c.matrix, c.distortion)[0].reshape(2) for c in (camera, half)
    )
    assert np.allclose((whole + 0.5) / 2 - 0.5, small, atol=1e-9)
    with pytest.raises(DataError, match="calibrate at the size"):
        camera.scaled((1280, 720))


def views(images):
    finder = BoardFinder(BOARD, DICTIONARY)
    found = [view for n, image in enumerate(images) if (view := finder.find(image, f"view {n}")) is not None]
    return found, finder.size


def test_too_few_and_too_like_views_are_refused():
    few, size = views(Views().many(4))
    with pytest.raises(DataError, match="4 usable views"):
        calibrate(few, size)
    alike, size = views([Views(seed=n).at((0, 0, 0.7))[0] for n in range(9)])
    with pytest.raises(DataError, match="cover"):
        calibrate(alike, size)


def test_views_from_straight_ahead_are_refused():
    places = [(x, y, 0.6) for x in (-0.14, 0, 0.14) for y in (-0.1, 0, 0.1)]
    flat, size = views([Views(seed=n).at(place)[0] for n, place in enumerate(places)])
    with pytest.raises(DataError, match="separate focal length and distance"):
        calibrate(flat, size)


def test_wrong_words_on_the_command_line(tmp_path, capsys, pictures):
    assert main(["calibrate", "camera"]) == 2
    assert main(["calibrate", "camera", str(tmp_path)]) == 5
    assert main(["calibrate", "camera", str(tmp_path / "no.png")]) == 5
    assert main(["calibrate", "camera", "rtsp://127.0.0.1:9/x", "--seconds", "1"]) == 4
    assert main(["calibrate", "camera", str(pictures), "--out", str(tmp_path / "camera.txt")]) == 2
    assert main(["calibrate", "camera", str(pictures), "--columns", "7"]) == 5
    assert main(["calibrate", "camera", "--board", str(tmp_path / "b.png"), "--marker-mm", "40"]) == 5
    assert "not a ChArUco board" in capsys.readouterr().err


def test_the_board_to_print_is_found_by_opencv(tmp_path):
    file = tmp_path / "board.png"
    assert main(["calibrate", "camera", "--board", str(file)]) == 0
    page = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
    small = cv2.resize(page, None, fx=0.4, fy=0.4, interpolation=cv2.INTER_AREA)
    view = BoardFinder(BOARD, DICTIONARY).find(small, "page")
    assert view is not None
    assert len(view.pixels) == (COLUMNS - 1) * (ROWS - 1)
    # At true size: 300 dpi, so many pixels a millimetre.
    span_px = np.ptp(view.pixels[:, 0]) / 0.4
    assert abs(span_px / (300 / 25.4) - (COLUMNS - 2) * SQUARE_MM) < 0.3
    assert main(["calibrate", "camera", "--board", str(tmp_path / "board.pdf")]) == 0
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")


def test_a_live_camera_without_a_board_ends_in_time(capsys):
    with served(time_camera()) as addresses:
        assert main(["calibrate", "camera", addresses["http"], "--seconds", "1"]) == 5
    assert "no board found" in capsys.readouterr().err


def test_a_board_is_a_body_with_a_pose():
    scene = Views()
    finder = FiducialFinder(scene.camera, DICTIONARY, {}, {"board": BOARD})
    image, rotation, position = scene.at((0.03, -0.02, 0.6), (20, -15, 5))
    found = finder.find(image, 0)["board"]
    assert np.abs(found.position_m - position).max() < 0.0006
    # The card's y points up and its z to the viewer, the board's the other way.
    assert np.abs(found.rotation - rotation @ np.diag([1.0, -1.0, -1.0])).max() < 0.005
