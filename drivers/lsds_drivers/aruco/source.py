"""Pose source `aruco`: poses of bodies with printed markers, from any camera, in its own thread."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.calibration.vision.camera import CameraModel, load_camera
from lsds.calibration.vision.fiducials import Board, Counts, FiducialFinder, Marker, dictionary_of
from lsds.calibration.vision.rotation import pose_of, rotation_of
from lsds.contracts import PoseSample
from lsds.errors import ConfigError, ConfigIssue, ConnectFailed, DataError, StaleData
from lsds_drivers.cameras.address import make_source
from lsds_drivers.cameras.device import CameraDevice

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import BuildContext
    from lsds_drivers.aruco.options import ArucoOptions

NAME = "aruco"


class ArucoPoseSource(CameraDevice[PoseSample]):
    """A `PoseSource`. Its poses are base <- body; a body that is not visible is absent; unknown markers are counted."""

    def __init__(self, options: ArucoOptions, context: BuildContext) -> None:
        self._options = options
        self._bodies, self._boards = _bodies(options)
        self._base_rotation = rotation_of(_quaternion(options.camera_quaternion_xyzw))
        self._base_position = np.array(options.camera_position_m)
        self._finder: FiducialFinder | None = None
        if not options.calibration and not options.camera.startswith("realsense"):
            raise _refused("calibration", "no file is named", "make one: lsds calibrate camera --help")
        size = (options.capture_width, options.capture_height)
        self._source = make_source(NAME, options.camera, size=size)
        super().__init__(NAME, self._source, self._look, options, context)

    @property
    def counts(self) -> Counts:
        """Counts of detections not used: unknown and duplicate markers, corners that fit no pose, ambiguous poses."""
        return self._finder.counts if self._finder is not None else Counts()

    def _prepare(self) -> None:
        if self._options.calibration:
            try:
                self._finder = self._make_finder(load_camera(self._options.calibration))
            except DataError as error:
                raise ConnectFailed(NAME, str(error)) from error

    def read(self) -> PoseSample:
        """Return the poses in the newest picture that could be used. Raises StaleData, EOFError after a recording."""
        self._guard.require_readable()
        try:
            return self._pump.newest()
        except DataError:
            # A damaged picture has no poses; the previous picture is then the newest with poses.
            return self._pump.newest()

    def _look(self, image: NDArray[np.uint8], t_ns: int, seq: int) -> PoseSample:
        if self._finder is None:
            self._finder = self._make_finder(self._own_calibration(image))
        found = self._finder.find(image, t_ns)
        poses = {
            body: pose_of(
                np.asarray(self._base_rotation @ seen.rotation),
                self._base_rotation @ seen.position_m + self._base_position,
            )
            for body, seen in found.items()
        }
        return PoseSample(t_ns, seq, poses)

    def _make_finder(self, camera: CameraModel) -> FiducialFinder:
        return FiducialFinder(
            camera, self._options.dictionary, self._bodies, self._boards, max_error_px=self._options.max_error_px
        )

    def _own_calibration(self, image: NDArray[np.uint8]) -> CameraModel:
        intrinsics = getattr(self._source, "intrinsics", None)
        if intrinsics is None:
            raise StaleData(NAME, "the camera has not reported its intrinsics")
        matrix, distortion = intrinsics
        return CameraModel(matrix, distortion, (image.shape[1], image.shape[0]))


def _bodies(options: ArucoOptions) -> tuple[dict[str, dict[int, Marker]], dict[str, Board]]:
    """Return markers by body and id, and boards by body. Raises ConfigError."""
    try:
        dictionary_of(options.dictionary)
    except DataError as error:
        raise _refused("dictionary", str(error)) from error
    bodies: dict[str, dict[int, Marker]] = {}
    owner: dict[int, str] = {}
    for place, marker in enumerate(options.markers):
        if marker.id in owner:
            raise _refused(f"markers.{place}.id", f"marker {marker.id} is already on '{owner[marker.id]}'")
        owner[marker.id] = marker.body
        fitted = Marker(marker.size_mm * 1e-3, (marker.x_mm * 1e-3, marker.y_mm * 1e-3))
        bodies.setdefault(marker.body, {})[marker.id] = fitted
    boards: dict[str, Board] = {}
    for place, board in enumerate(options.boards):
        if board.body in bodies or board.body in boards:
            raise _refused(f"boards.{place}.body", f"'{board.body}' has a marker or a board already")
        made = Board(
            board.columns, board.rows, board.square_mm * 1e-3, board.marker_mm * 1e-3, board.first_id, board.legacy
        )
        try:
            made.make(options.dictionary)
        except DataError as error:
            raise _refused(f"boards.{place}", str(error)) from error
        boards[board.body] = made
    if not bodies and not boards:
        raise _refused("markers", "none are named", "write [[pose_source.aruco.markers]] with id, body and size_mm")
    return bodies, boards


def _quaternion(parts: list[float]) -> tuple[float, float, float, float]:
    x, y, z, w = parts
    if not math.hypot(x, y, z, w) > 1e-6:
        raise _refused("camera_quaternion_xyzw", "has no length", "[0, 0, 0, 1] turns nothing")
    return x, y, z, w


def _refused(key: str, problem: str, remedy: str = "") -> ConfigError:
    return ConfigError("[pose_source.aruco]", [ConfigIssue(f"pose_source.aruco.{key}", problem, remedy)])
