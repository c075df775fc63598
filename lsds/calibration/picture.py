"""Two pictures of a calibration: which parts of the picture the views cover and how well they fit; and the board."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lsds.calibration.vision.board_views import GRID
from lsds.session.pictures.figure import new_figure

if TYPE_CHECKING:
    from lsds.calibration.vision.board_views import Calibration, View
    from lsds.calibration.vision.fiducials import Board

_MM_PER_INCH = 25.4
"""Millimetres per inch, by definition."""
_MARGIN_MM = 10.0
"""Margin of white paper around the board, mm; chosen."""


def plot_calibration(path: Path, calibration: Calibration, views: Sequence[View]) -> None:
    """Write the picture: corners over the image with the cells they fall in, and their residuals."""
    width, height = calibration.camera.size
    figure = new_figure(11, 5.2)
    covered, left = figure.subplots(1, 2, width_ratios=[1.6, 1.0])
    shown = covered.imshow(
        calibration.cells, cmap="Blues", extent=(-0.5, width - 0.5, height - 0.5, -0.5), vmin=0, alpha=0.8
    )
    figure.colorbar(shown, ax=covered, label="corners in a cell", shrink=0.8)
    for view in views:
        covered.plot(view.pixels[:, 0], view.pixels[:, 1], ".", ms=3, alpha=0.7)
    for row, column in zip(*np.nonzero(calibration.cells == 0), strict=True):
        at = ((column + 0.5) * width / GRID[0], (row + 0.5) * height / GRID[1])
        covered.annotate("none", at, ha="center", va="center", color="tab:red", fontsize=8)
    centre = calibration.camera.matrix[:2, 2]
    covered.plot(*centre, "+", color="black", ms=12, label="principal point")
    covered.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="x (px)", ylabel="y (px)")
    covered.set_title(f"{len(views)} views cover {calibration.coverage:.0%} of the picture", fontsize=10)
    covered.legend(loc="lower right", fontsize=8)

    residuals = calibration.residuals_px
    reach = max(0.1, float(np.percentile(np.abs(residuals), 99.5)) * 1.2)
    left.plot(residuals[:, 0], residuals[:, 1], ".", ms=3, alpha=0.5)
    left.axhline(0, color="0.6", lw=0.8)
    left.axvline(0, color="0.6", lw=0.8)
    left.set(xlim=(-reach, reach), ylim=(reach, -reach), xlabel="x left over (px)", ylabel="y left over (px)")
    left.set_aspect("equal")
    fx, fy = calibration.camera.matrix[0, 0], calibration.camera.matrix[1, 1]
    left.set_title(
        f"{calibration.error_px:.3f} px RMS; f = {fx:.1f} ± {calibration.std_px[0]:.1f}, "
        f"{fy:.1f} ± {calibration.std_px[1]:.1f} px",
        fontsize=10,
    )
    figure.savefig(path, dpi=110)


def draw_board(path: Path, board: Board, dictionary: str) -> tuple[float, float]:
    """Write the board for printing at true size, as PNG (300 dpi) or PDF; return the page's size in mm.

    A ruler line of 100 mm under it shows whether the printer kept the size.
    """
    made = board.make(dictionary)
    square_mm = board.square_m * 1e3
    size_mm = (board.columns * square_mm, board.rows * square_mm)
    # A whole number of pixels for each module, or the edges of the squares would lie between pixels.
    per_square = max(60, round(square_mm / _MM_PER_INCH * 300))
    image = made.generateImage((board.columns * per_square, board.rows * per_square), marginSize=0, borderBits=1)
    page_mm = (size_mm[0] + 2 * _MARGIN_MM, size_mm[1] + 3 * _MARGIN_MM)
    figure = new_figure(page_mm[0] / _MM_PER_INCH, page_mm[1] / _MM_PER_INCH, layout=None)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, page_mm[0]), ylim=(0, page_mm[1]))
    axes.axis("off")
    low = 2 * _MARGIN_MM
    extent = (_MARGIN_MM, _MARGIN_MM + size_mm[0], low, low + size_mm[1])
    axes.imshow(image, cmap="gray", vmin=0, vmax=255, extent=extent, interpolation="nearest", aspect="auto")
    ruler = min(100.0, 10 * (size_mm[0] // 10))
    axes.plot([_MARGIN_MM, _MARGIN_MM + ruler], [12, 12], color="black", lw=1, marker="|", ms=8)
    text = (
        f"this line is {ruler:.0f} mm    ChArUco {board.columns} x {board.rows}, square {square_mm:g} mm, "
        f"marker {board.marker_m * 1e3:g} mm, {dictionary}"
    )
    axes.text(_MARGIN_MM, 4, text, fontsize=min(8.0, size_mm[0] / 22))
    figure.savefig(path, dpi=300)
    return page_mm
