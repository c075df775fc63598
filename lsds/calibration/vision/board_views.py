"""Camera calibration from views of a ChArUco board, with checks that the views suffice.

A small reprojection error does not prove a good calibration: a dozen views from one place fit each other well but do
not constrain the corners of the picture. Therefore the views are checked, and too few or too similar views are refused.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

from lsds.calibration.vision.camera import CameraModel
from lsds.errors import DataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.calibration.vision.fiducials import Board

GRID = (8, 6)
"""Columns and rows of the grid on which the coverage of the picture is measured."""
LEAST_CORNERS = 6
"""Minimum number of corners of a view; chosen."""
LEAST_BOARD_COVERAGE = 0.5
"""Minimum share of the picture that the views cover together; chosen."""
MOST_ERROR_PX = 1.5
"""Maximum reprojection error, px RMS; chosen."""
MOST_FOCAL_SPREAD = 0.02
"""Maximum relative uncertainty of the focal length; chosen."""
LEAST_TILT_RAD = math.radians(20)
"""Minimum angle between the boards of two views, rad; chosen."""
_ADVICE = "move the board over the whole picture, near and far, and tilt it by 20 to 40 degrees in both directions"


class View(NamedTuple):
    """The board in one picture: the name of the picture, points on the board (n, 3) in m, and their pixels (n, 2)."""

    name: str
    points_m: NDArray[np.float32]
    pixels: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The camera; RMS reprojection error, in total and of each view (px); standard deviations of focal lengths and
    principal point (px); number of corners in each cell of the picture (rows, columns); residuals (n, 2) in px."""

    camera: CameraModel
    error_px: float
    view_errors_px: tuple[float, ...]
    std_px: tuple[float, float, float, float]
    cells: NDArray[np.intp]
    residuals_px: NDArray[np.float64]

    @property
    def coverage(self) -> float:
        """Fraction of the picture's cells in which a corner was seen."""
        return float((self.cells > 0).mean())


class BoardFinder:
    """Finds one board in pictures that all have one size."""

    def __init__(self, board: Board, dictionary: str) -> None:
        self._board = board.make(dictionary)
        self._detector = cv2.aruco.CharucoDetector(self._board)
        self.size: tuple[int, int] | None = None

    def find(self, image: NDArray[np.uint8], name: str) -> View | None:
        """Return the view, None if too little of the board is visible. Raises DataError for a picture of another
        size."""
        size = (image.shape[1], image.shape[0])
        if self.size is None:
            self.size = size
        if size != self.size:
            raise DataError(
                f"{name}: is {size[0]} x {size[1]} px, the earlier pictures {self.size[0]} x {self.size[1]} "
                "(all pictures must have the same size)"
            )
        grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) if image.ndim == 3 else image, np.uint8)
        corners, numbers, _, _ = self._detector.detectBoard(grey)
        if numbers is None or len(numbers) < LEAST_CORNERS:
            return None
        points, pixels = self._board.matchImagePoints(corners, numbers)
        points, pixels = points.reshape(-1, 3), pixels.reshape(-1, 2)
        if np.linalg.matrix_rank(points[:, :2] - points[0, :2]) < 2:
            return None
        return View(name, points.astype(np.float32), pixels.astype(np.float32))


def is_new(view: View, taken: Sequence[View], width: int) -> bool:
    """Return whether a view differs from the earlier ones, in position by a twelfth of the picture's width, or in
    shape."""
    shape = _shape(view)
    return all(float(np.abs(shape - _shape(other)).max()) > width / 12 for other in taken)


def calibrate(views: Sequence[View], size: tuple[int, int], *, least_views: int = 8) -> Calibration:
    """Return the calibration for a picture of (width, height). Raises DataError if the views do not suffice."""
    if len(views) < least_views:
        raise DataError(f"{len(views)} usable views of the board, at least {least_views} are needed ({_ADVICE})")
    cells = _cells(views, size)
    covered = float((cells > 0).mean())
    if covered < LEAST_BOARD_COVERAGE:
        raise DataError(
            f"the views cover {covered:.0%} of the picture, at least {LEAST_BOARD_COVERAGE:.0%} are needed ({_ADVICE})"
        )
    try:
        error, matrix, distortion, rotations, positions, spread, _, per_view = cv2.calibrateCameraExtended(
            [view.points_m for view in views], [view.pixels for view in views], size, np.eye(3), np.zeros(5)
        )
    except cv2.error as failure:
        raise DataError(f"the views fit no camera: {str(failure).strip().splitlines()[-1]} ({_ADVICE})") from failure
    camera = CameraModel(np.asarray(matrix, np.float64), np.asarray(distortion, np.float64).reshape(-1)[:5], size)
    errors = tuple(float(e) for e in np.asarray(per_view).reshape(-1))
    if not np.isfinite(error) or error > MOST_ERROR_PX:
        worst = views[int(np.argmax(errors))].name
        raise DataError(
            f"the reprojection error is {error:.2f} px, the limit is {MOST_ERROR_PX}; the worst view is {worst} "
            "(check that the board is flat, that its squares have the given size, and that the pictures are sharp)"
        )
    tilt = _tilt_rad(rotations)
    if tilt < LEAST_TILT_RAD:
        raise DataError(
            f"the views tilt the board by {math.degrees(tilt):.0f} degrees against one another, at least "
            f"{math.degrees(LEAST_TILT_RAD):.0f} are needed to separate focal length and distance ({_ADVICE})"
        )
    fx, fy, cx, cy = (float(s) for s in np.asarray(spread).reshape(-1)[:4])
    if fx > MOST_FOCAL_SPREAD * camera.matrix[0, 0] or fy > MOST_FOCAL_SPREAD * camera.matrix[1, 1]:
        raise DataError(
            f"the focal length is uncertain by {max(fx, fy):.0f} px of {camera.matrix[0, 0]:.0f} ({_ADVICE})"
        )
    return Calibration(
        camera, float(error), errors, (fx, fy, cx, cy), cells, _residuals(views, camera, rotations, positions)
    )


def _cells(views: Sequence[View], size: tuple[int, int]) -> NDArray[np.intp]:
    pixels = np.concatenate([view.pixels for view in views])
    columns, rows = GRID
    x = np.clip((pixels[:, 0] + 0.5) / size[0] * columns, 0, columns - 1).astype(np.intp)
    y = np.clip((pixels[:, 1] + 0.5) / size[1] * rows, 0, rows - 1).astype(np.intp)
    counts = np.zeros((rows, columns), np.intp)
    np.add.at(counts, (y, x), 1)
    return counts


def _tilt_rad(rotations: Sequence[Any]) -> float:
    """Return the largest angle between the board's normals in any two views."""
    normals = np.stack([cv2.Rodrigues(rotation)[0][:, 2] for rotation in rotations])
    return math.acos(min(1.0, max(-1.0, float((normals @ normals.T).min()))))


def _residuals(
    views: Sequence[View], camera: CameraModel, rotations: Sequence[Any], positions: Sequence[Any]
) -> NDArray[np.float64]:
    found = []
    for view, rotation, position in zip(views, rotations, positions, strict=True):
        back, _ = cv2.projectPoints(view.points_m, rotation, position, camera.matrix, camera.distortion)
        found.append(view.pixels - back.reshape(-1, 2))
    return np.concatenate(found).astype(np.float64)


def _shape(view: View) -> NDArray[np.float64]:
    """Return the pixels of the board's four outermost reference points in a view, by a homography without a camera
    model."""
    low, high = view.points_m[:, :2].min(axis=0), view.points_m[:, :2].max(axis=0)
    onto, _ = cv2.findHomography(view.points_m[:, :2], view.pixels)
    if onto is None:
        return np.asarray(view.pixels.mean(axis=0)[None].repeat(4, axis=0), np.float64)
    corners = np.array([[low, (high[0], low[1]), high, (low[0], high[1])]], np.float64).reshape(-1, 1, 2)
    return np.asarray(cv2.perspectiveTransform(corners, onto), np.float64).reshape(-1, 2)
