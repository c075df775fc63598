"""Rendered views of a ChArUco board, with a camera that is known."""

from __future__ import annotations

import cv2
import numpy as np
from lsds_mocks.scene.cards import PAPER_LEVEL, TEXELS_PER_MM, TONER_LEVEL, Card
from lsds_mocks.scene.lens import camera_model
from lsds_mocks.scene.painter import Painter
from lsds_mocks.scene.stage import finished


def board_card(columns, rows, square_mm, marker_mm, *, dictionary):
    """Return a ChArUco board on white paper; its frame's origin is the board's upper left corner, y up."""
    board = cv2.aruco.CharucoBoard(
        (columns, rows),
        square_mm,
        marker_mm,
        cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{dictionary}")),
    )
    per_square = round(square_mm * TEXELS_PER_MM)
    margin = per_square // 2
    size = (columns * per_square + 2 * margin, rows * per_square + 2 * margin)
    drawn = board.generateImage(size, marginSize=margin, borderBits=1)
    texture = np.where(drawn > 127, PAPER_LEVEL, TONER_LEVEL).astype(np.uint8)
    return Card(texture, (margin - 0.5, margin - 0.5), per_square / (square_mm * 1e-3))


COLUMNS, ROWS, SQUARE_MM, MARKER_MM, DICTIONARY = 8, 6, 30.0, 22.0, "4X4_50"
CARD = board_card(COLUMNS, ROWS, SQUARE_MM, MARKER_MM, dictionary=DICTIONARY)
CENTRE_M = np.array([COLUMNS * SQUARE_MM / 2, -ROWS * SQUARE_MM / 2, 0]) * 1e-3
TOWARDS = np.diag([1.0, -1.0, -1.0])
"""camera <- card for a card that is held up straight: x right, y up, z towards the viewer."""


def turned(x_deg, y_deg, z_deg):
    x, y, z = np.deg2rad((x_deg, y_deg, z_deg))
    about_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    about_z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    return TOWARDS @ about_z @ about_y @ about_x


class Views:
    """Renders the board anywhere before one camera."""

    def __init__(self, width=640, height=480, seed=0):
        self.camera = camera_model(width, height)
        self._painter = Painter(self.camera)
        self._noise = np.random.default_rng(seed).normal(0, 1.6, (height, width)).astype(np.float32)

    def at(self, centre_m, turn_deg=(0.0, 0.0, 0.0)):
        """Picture of the board with its middle at a point before the camera, and the pose camera <- card."""
        rotation = turned(*turn_deg)
        position = np.asarray(centre_m, float) - rotation @ CENTRE_M
        image = np.full(self._noise.shape, 130, np.float32)
        self._painter.paint(image, CARD, lambda share: (rotation, position))
        return finished(image, self._noise, [0, 0]), rotation, position

    def many(self, count, seed=1, spread=1.0):
        """Pictures from all over: near and far, tilted both ways."""
        rng = np.random.default_rng(seed)
        for _ in range(count):
            depth = rng.uniform(0.42, 0.75)
            reach = spread * depth * np.array([0.36, 0.27])
            x, y = rng.uniform(-reach, reach)
            yield self.at((x, y, depth), spread * rng.uniform(-32, 32, 3) * (1, 1, 0.5))[0]
