"""Poses of bodies from printed ArUco markers and ChArUco boards: sub-pixel corners, and poses from corners.

A flat marker seen nearly face on has two poses that explain its corners almost equally well (Collins and Bartoli 2014,
"Infinitesimal plane-based pose estimation"). Both are computed; if their errors do not distinguish them, the one with
the smaller rotation since the last picture is used.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from lsds.calibration.vision.edges import refined_corners
from lsds.calibration.vision.rotation import angle_between
from lsds.errors import DataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.calibration.vision.camera import CameraModel

AMBIGUOUS_RATIO = 2.0
"""A second pose is ambiguous if its error is less than this many times that of the first one."""
MEMORY_NS = 500_000_000
"""Maximum age of a body's last orientation, ns."""


@dataclass(frozen=True, slots=True)
class Marker:
    """One printed marker: the side of its black square (m), and its centre in the body's frame (m).

    Markers of one body lie in its plane z = 0, x right and y up as printed, z towards the viewer.
    """

    size_m: float
    centre_m: tuple[float, float] = (0.0, 0.0)

    def corners(self) -> NDArray[np.float64]:
        """Return the corners (4, 3) in the body's frame, in the order in which OpenCV finds them."""
        x, y, half = *self.centre_m, self.size_m / 2
        return np.array(
            [(x - half, y + half, 0), (x + half, y + half, 0), (x + half, y - half, 0), (x - half, y - half, 0)]
        )


@dataclass(frozen=True, slots=True)
class Board:
    """A ChArUco board: squares across and down, sides of square and marker (m), the first marker's id.

    Its frame is OpenCV's: the origin at the upper left corner as printed, x right, y down, z away from the viewer.
    """

    columns: int
    rows: int
    square_m: float
    marker_m: float
    first_id: int = 0
    legacy: bool = False

    def make(self, dictionary: str) -> Any:
        """Return OpenCV's board. Raises DataError if the parameters are invalid."""
        if self.marker_m >= self.square_m:
            raise DataError("not a ChArUco board: its markers must be smaller than its squares")
        count = (self.columns * self.rows) // 2
        ids = np.arange(self.first_id, self.first_id + count)
        try:
            board = cv2.aruco.CharucoBoard(
                (self.columns, self.rows), self.square_m, self.marker_m, dictionary_of(dictionary), ids
            )
        # OpenCV's constructors wrap their own errors in this one.
        except (cv2.error, SystemError) as error:
            why = str(error.__cause__ or error).strip().splitlines()[-1]
            raise DataError(f"not a ChArUco board: {why} (is dictionary {dictionary} large enough for it?)") from error
        board.setLegacyPattern(self.legacy)
        return board


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A body in one picture: pose camera <- body, RMS reprojection error (px), corners used, and whether a second pose
    fits equally well."""

    rotation: NDArray[np.float64]
    position_m: NDArray[np.float64]
    error_px: float
    corners: int
    ambiguous: bool


@dataclass(slots=True)
class Counts:
    """Counts of detections that were not used, since the start."""

    unknown: dict[int, int] = field(default_factory=dict)
    doubled: int = 0
    rejected: int = 0
    ambiguous: int = 0


def dictionary_of(name: str) -> Any:
    """Return OpenCV's dictionary by name, such as "4X4_50" or "APRILTAG_36h11". Raises DataError."""
    number = getattr(cv2.aruco, f"DICT_{name}", None)
    if number is None:
        known = ", ".join(sorted(n.removeprefix("DICT_") for n in dir(cv2.aruco) if n.startswith("DICT_")))
        raise DataError(f"unknown marker dictionary '{name}' (known: {known})")
    return cv2.aruco.getPredefinedDictionary(number)


class FiducialFinder:
    """Finds bodies in pictures of one camera, one picture after another."""

    def __init__(
        self,
        camera: CameraModel,
        dictionary: str,
        bodies: Mapping[str, Mapping[int, Marker]],
        boards: Mapping[str, Board] | None = None,
        *,
        max_error_px: float = 2.0,
    ) -> None:
        self._camera = camera
        self._bodies = {name: dict(markers) for name, markers in bodies.items()}
        self._body_of = {number: name for name, markers in bodies.items() for number in markers}
        self._max_error_px = max_error_px
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(dictionary_of(dictionary), parameters)
        self._boards: dict[str, tuple[Any, Any]] = {}
        for name, board in (boards or {}).items():
            made = board.make(dictionary)
            self._boards[name] = (made, cv2.aruco.CharucoDetector(made))
            self._body_of |= dict.fromkeys((int(i) for i in made.getIds().reshape(-1)), name)
        self._last: dict[str, tuple[int, NDArray[np.float64]]] = {}
        self.counts = Counts()

    def find(self, image: NDArray[np.uint8], t_ns: int) -> dict[str, Found]:
        """Return the bodies seen in a uint8 picture, RGB (h, w, 3) or grey (h, w), taken at `t_ns`.

        A body that is not visible, or whose corners fit no pose, is absent. Raises DataError for a picture of another
        shape than the calibration's.
        """
        camera = self._camera.scaled((image.shape[1], image.shape[0]))
        grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) if image.ndim == 3 else image, np.uint8)
        corners, numbers, _ = self._detector.detectMarkers(grey)
        seen: dict[int, NDArray[np.float64]] = {}
        doubled: set[int] = set()
        listed = [] if numbers is None else [int(number) for number in numbers.reshape(-1)]
        for quad, number in zip(corners, listed, strict=True):
            if number not in self._body_of:
                self.counts.unknown[number] = self.counts.unknown.get(number, 0) + 1
            elif number in seen:
                doubled.add(number)
            else:
                seen[number] = refined_corners(grey, np.asarray(quad, np.float64).reshape(4, 2))
        # Of two markers with the same id, one is a reflection or a copy, and they cannot be distinguished.
        self.counts.doubled += len(doubled)
        found = {}
        for name, markers in self._bodies.items():
            usable = [number for number in markers if number in seen and number not in doubled]
            if usable:
                points = np.concatenate([markers[number].corners() for number in usable])
                pose = self._pose(name, points, np.concatenate([seen[n] for n in usable]), camera, t_ns)
                if pose is not None:
                    found[name] = pose
        for name, (board, detector) in self._boards.items():
            pose = self._board_pose(name, board, detector, grey, camera, t_ns)
            if pose is not None:
                found[name] = pose
        return found

    def _board_pose(
        self, name: str, board: Any, detector: Any, grey: NDArray[np.uint8], camera: CameraModel, t_ns: int
    ) -> Found | None:
        corners, numbers, _, _ = detector.detectBoard(grey)
        if numbers is None or len(numbers) < 4:
            return None
        points, pixels = board.matchImagePoints(corners, numbers)
        if np.linalg.matrix_rank(points.reshape(-1, 3)[:, :2] - points.reshape(-1, 3)[0, :2]) < 2:
            return None  # all corners on one line: no pose
        return self._pose(name, points.reshape(-1, 3).astype(np.float64), pixels.reshape(-1, 2), camera, t_ns)

    def _pose(
        self, name: str, points: NDArray[np.float64], pixels: NDArray[Any], camera: CameraModel, t_ns: int
    ) -> Found | None:
        candidates = sorted(_candidates(points, np.asarray(pixels, np.float64), camera), key=lambda c: c[2])
        if not candidates or candidates[0][2] > self._max_error_px:
            self.counts.rejected += 1
            return None
        best = candidates[0]
        ambiguous = len(candidates) > 1 and candidates[1][2] < AMBIGUOUS_RATIO * best[2] + 1e-9
        if ambiguous:
            self.counts.ambiguous += 1
            last = self._last.get(name)
            if last is not None and t_ns - last[0] <= MEMORY_NS:
                before = last[1]
                best = min(candidates[:2], key=lambda c: angle_between(before, c[0]))
        self._last[name] = (t_ns, best[0])
        return Found(best[0], best[1], best[2], len(points), ambiguous)


def _candidates(
    points: NDArray[np.float64], pixels: NDArray[np.float64], camera: CameraModel
) -> Sequence[tuple[NDArray[np.float64], NDArray[np.float64], float]]:
    """Return the poses (rotation, position, error) that explain the corners, each refined to the minimum error."""
    try:
        count, rotations, positions, _ = cv2.solvePnPGeneric(
            points, pixels, camera.matrix, camera.distortion, flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error:
        return []
    found = []
    for vector, position in zip(rotations[:count], positions[:count], strict=True):
        refined, moved = cv2.solvePnPRefineLM(points, pixels, camera.matrix, camera.distortion, vector, position)
        back, _ = cv2.projectPoints(points, refined, moved, camera.matrix, camera.distortion)
        error = float(np.sqrt(((back.reshape(-1, 2) - pixels) ** 2).sum(axis=1).mean()))
        rotation = np.asarray(cv2.Rodrigues(refined)[0], np.float64)
        if moved[2, 0] > 0 and np.isfinite(error):
            found.append((rotation, np.asarray(moved, np.float64).reshape(3), error))
    return found
