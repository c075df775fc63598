"""Camera model: pinhole with Brown-Conrady distortion, and its calibration file."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lsds.errors import DataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

_MATRIX_NAMES = ("camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M1")
_DISTORTION_NAMES = ("distortion_coefficients", "distCoeffs", "dist_coeffs", "Distortion_Coefficients", "D", "D1")
_WIDTH_NAMES, _HEIGHT_NAMES = ("image_width", "image_Width"), ("image_height", "image_Height")
_REMEDY = "make one with: lsds calibrate camera --help"


@dataclass(frozen=True, slots=True, eq=False)
class CameraModel:
    """`matrix` (3, 3) in pixels, `distortion` (n,) in OpenCV's order k1 k2 p1 p2 [k3 ...], `size` (width, height).

    A camera's frame has x right, y down, z forward; pixel centres lie at integers.
    """

    matrix: NDArray[np.float64]
    distortion: NDArray[np.float64]
    size: tuple[int, int]

    def scaled(self, size: tuple[int, int]) -> CameraModel:
        """Return the model for the same picture scaled to another size. Raises DataError for another aspect ratio."""
        if size == self.size:
            return self
        share = size[0] / self.size[0]
        if abs(size[1] / self.size[1] - share) > 0.01 * share:
            raise DataError(
                f"the camera is calibrated for {self.size[0]} x {self.size[1]} px and gives {size[0]} x {size[1]}, "
                "which shows another part of the scene (calibrate at the size that is used)"
            )
        matrix = self.matrix.copy()
        matrix[:2] *= share
        # Pixel centres are at integers, so the fixed point of the scaling is the picture's corner at -0.5.
        matrix[:2, 2] += 0.5 * (share - 1)
        return CameraModel(matrix, self.distortion, size)


def load_camera(path: str | Path) -> CameraModel:
    """Read a calibration as OpenCV's FileStorage writes it: YAML, JSON or XML, with any of the usual names.

    Raises DataError that names the file, what is wrong with it, and what to do.
    """
    import cv2

    file = Path(path).expanduser()
    if not file.is_file():
        raise DataError(f"{file}: the calibration file does not exist ({_REMEDY})")
    try:
        text = file.read_text(encoding="utf-8")
        # OpenCV writes to stderr before it raises for an unknown format, so check the format first.
        if not text.lstrip().startswith(("%YAML", "{", "<?xml")):
            raise DataError(f"{file}: is neither YAML (which begins with %YAML:1.0) nor JSON nor XML ({_REMEDY})")
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        matrix = _matrix(storage, _MATRIX_NAMES)
        distortion = _matrix(storage, _DISTORTION_NAMES)
        size = (_whole(storage, _WIDTH_NAMES), _whole(storage, _HEIGHT_NAMES))
        storage.release()
    except (cv2.error, OSError, UnicodeDecodeError, SystemError) as error:
        raise DataError(f"{file}: cannot be read as a calibration: {str(error).strip()[:200]} ({_REMEDY})") from error
    if matrix is None or matrix.shape != (3, 3):
        raise DataError(f"{file}: holds no 3 x 3 matrix named {' or '.join(_MATRIX_NAMES[:2])} ({_REMEDY})")
    if 0 in size:
        raise DataError(f"{file}: does not state image_width and image_height of the calibration ({_REMEDY})")
    focal = (matrix[0, 0], matrix[1, 1])
    if not np.isfinite(matrix).all() or min(focal) <= 0 or matrix[2, 2] != 1:
        raise DataError(f"{file}: its camera matrix is invalid: {matrix.tolist()} ({_REMEDY})")
    coefficients = np.zeros(5) if distortion is None else distortion.reshape(-1)
    if coefficients.size not in (4, 5, 8, 12, 14) or not np.isfinite(coefficients).all():
        raise DataError(f"{file}: has {coefficients.size} distortion coefficients; 4, 5, 8, 12 or 14 are supported")
    return CameraModel(matrix, coefficients, size)


def save_camera(path: str | Path, camera: CameraModel, notes: dict[str, float | int | str] | None = None) -> None:
    """Write a calibration for OpenCV, and others, to read; YAML or JSON by the file's ending. Raises DataError."""
    import cv2

    file = Path(path).expanduser()
    try:
        # Write to a temporary file and rename it: a partly written calibration could be read as a wrong one.
        fresh = file.with_name(f".{file.stem}.partial{file.suffix}")
        storage = cv2.FileStorage(str(fresh), cv2.FILE_STORAGE_WRITE)
        if not storage.isOpened():
            raise OSError("cannot be written")
        storage.write("image_width", camera.size[0])
        storage.write("image_height", camera.size[1])
        storage.write("camera_matrix", camera.matrix)
        storage.write("distortion_coefficients", camera.distortion.reshape(1, -1))
        for name, value in (notes or {}).items():
            storage.write(name, value)
        storage.release()
        os.replace(fresh, file)
    except (cv2.error, OSError) as error:
        raise DataError(f"{file}: the calibration cannot be written: {str(error).strip()[:200]}") from error


def _matrix(storage: object, names: tuple[str, ...]) -> NDArray[np.float64] | None:
    for name in names:
        node = storage.getNode(name)  # type: ignore[attr-defined]
        if node.isMap() and node.mat() is not None:
            return np.asarray(node.mat(), np.float64)
    return None


def _whole(storage: object, names: tuple[str, ...]) -> int:
    for name in names:
        node = storage.getNode(name)  # type: ignore[attr-defined]
        if not node.empty() and node.real() > 0:
            return int(node.real())
    return 0
