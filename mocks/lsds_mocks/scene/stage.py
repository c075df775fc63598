"""The scene of the ground-truth camera: a wall, a table, and one marked card each on gripper and object."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.calibration.vision.rotation import pose_of, rotation_of
from lsds.contracts import Pose
from lsds_mocks.scene.cards import Card, marker_card
from lsds_mocks.scene.lens import Viewpoint, camera_model
from lsds_mocks.scene.painter import Layer, Painter

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts.plant_links import Scene

DICTIONARY = "4X4_50"
MARKERS: dict[str, tuple[int, float]] = {"gripper": (0, 36.0), "object": (1, 36.0)}
"""Body -> (marker id, side of its black square in mm)."""

FACING = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""base <- card: the card's x to the right, its y up, its z along the base's -y, towards the camera."""
AT_M: dict[str, tuple[float, float, float]] = {"gripper": (0.034, -0.01, 0.06), "object": (-0.034, 0.0, 0.11)}
"""Position of each marker's centre; the height counts from the pads (gripper) or from the object's foot (object)."""
VIEWPOINT = Viewpoint.looking((0.15, -0.38, 0.17), (0.0, 0.0, 0.15))
"""The camera is level with the markers, because slip is vertical and a single camera is least accurate in depth. It
views them obliquely, because a marker viewed face on has two possible poses."""

_LENS_BLUR_PX = 0.55
"""Standard deviation of the lens's blur, px; chosen."""
_NOISE_LEVELS = 1.6
"""Standard deviation of the sensor's noise at a noise of 1, grey levels; chosen."""
_SPARE = 64
"""Excess of the noise field over the picture in both directions, px: the range of the window's position; chosen."""


def truth_pose(scene: Scene, body: str) -> Pose:
    """Return the true pose, base <- marker, of a body in a scene."""
    x, y, z = AT_M[body]
    height = scene.arm_m if body == "gripper" else scene.object_m
    return pose_of(FACING, np.array([x, y, z + height]))


class Stage:
    """Renders scenes. Equal scenes and number give a bit-identical picture."""

    def __init__(self, width: int, height: int, seed: list[int], *, noise: float = 1.0) -> None:
        self.camera = camera_model(width, height)
        self._painter = Painter(self.camera)
        self._cards = _cards()
        # Parts at rest look the same as in the previous picture.
        self._last: dict[str, tuple[tuple[Pose, Pose], Layer | None]] = {}
        rng = np.random.default_rng(seed)
        self._back = _backdrop(width, height, rng)
        field = rng.standard_normal((height + _SPARE, width + _SPARE)).astype(np.float32)
        self._noise = field * np.float32(_NOISE_LEVELS * noise)
        self._corners = rng.integers(0, _SPARE + 1, (1021, 2)).tolist()

    def render(self, begin: Scene, end: Scene, number: int) -> NDArray[np.uint8]:
        """Return the picture, uint8 RGB (height, width, 3), of an exposure from one scene to another."""
        image = self._back.copy()
        for body in self._cards:
            early, late = truth_pose(begin, body), truth_pose(end, body)
            if body not in self._last or self._last[body][0] != (early, late):
                self._last[body] = (early, late), self._seen(body, early, late)
            layer = self._last[body][1]
            if layer is not None:
                layer.onto(image)
        return finished(image, self._noise, self._corners[number % len(self._corners)])

    def _seen(self, body: str, early: Pose, late: Pose) -> Layer | None:
        rotation = rotation_of(early.quaternion_xyzw)
        start, finish = np.array(early.position_m), np.array(late.position_m)

        def seen(share: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            return VIEWPOINT.seen(rotation, start + share * (finish - start))

        return self._painter.layer(self._cards[body], seen)


def finished(image: NDArray[np.float32], noise: NDArray[np.float32], corner: list[int]) -> NDArray[np.uint8]:
    """Return a grey picture with the lens's blur and the sensor's noise, as uint8 RGB."""
    rows, columns = image.shape
    soft = cv2.GaussianBlur(image, (0, 0), _LENS_BLUR_PX)
    noisy = cv2.add(soft, noise[corner[0] : corner[0] + rows, corner[1] : corner[1] + columns])
    # Rounds and clips at both ends; no level is close to black.
    return np.asarray(cv2.cvtColor(cv2.convertScaleAbs(noisy), cv2.COLOR_GRAY2RGB), np.uint8)


def _cards() -> dict[str, Card]:
    shapes = {"gripper": (48.0, 60.0, 30.0), "object": (48.0, 150.0, 34.0)}
    return {
        body: marker_card(
            number,
            size,
            dictionary=DICTIONARY,
            width_mm=shapes[body][0],
            height_mm=shapes[body][1],
            marker_at_mm=shapes[body][2],
        )
        for body, (number, size) in MARKERS.items()
    }


def _backdrop(width: int, height: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """Return a wall above a darker table, with smooth variations that no detector takes for a marker."""
    rows = np.linspace(0, 1, height, dtype=np.float32)[:, None]
    wall = 150 - 25 * rows + np.zeros((1, width), np.float32)
    blotches = cv2.resize(
        rng.standard_normal((12, 16)).astype(np.float32), (width, height), interpolation=cv2.INTER_CUBIC
    )
    image = wall + 4 * blotches
    image[round(0.8 * height) :] -= 45
    return np.asarray(image, np.float32)
