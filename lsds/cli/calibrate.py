"""`lsds calibrate`: calibrate cameras, slip detection and the load on the user's own cell."""

from __future__ import annotations

from pathlib import Path

import click

from lsds.cli.calibrate_grip import grip
from lsds.cli.calibrate_slip import slip
from lsds.cli.finite import FiniteRange
from lsds.cli.output import json_option, require_writable, write_json
from lsds.cli.text_table import table
from lsds.errors import DataError

_HELP = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


@click.group(context_settings=_HELP)
def calibrate() -> None:
    """Calibrate a camera, or the detection of slip and the load on your own gel.

    \b
    Examples:
      lsds calibrate grip rig.toml --mass-g 320       loads in newtons
      lsds calibrate slip rig.toml --by-hand          thresholds for this gel
      lsds calibrate camera --board board.pdf         print the board
      lsds calibrate camera views/ --out camera.yaml  use pictures of it
    """


calibrate.add_command(grip)
calibrate.add_command(slip)


@calibrate.command(context_settings=_HELP)
@click.argument("sources", nargs=-1, metavar="[SOURCE...]")
@click.option(
    "--out", type=click.Path(dir_okay=False, path_type=Path), help="Calibration file to write: .yaml or .json."
)
@click.option("--plot", type=click.Path(dir_okay=False, path_type=Path), help="Draw coverage and residuals to a PNG.")
@click.option("--board", type=click.Path(dir_okay=False, path_type=Path), help="Only write the board: .png or .pdf.")
@click.option(
    "--columns", type=click.IntRange(3, 50), default=8, show_default=True, help="Number of columns of squares."
)
@click.option("--rows", type=click.IntRange(3, 50), default=6, show_default=True, help="Number of rows of squares.")
@click.option(
    "--square-mm", type=FiniteRange(1, 1000), default=30.0, show_default=True, help="Side length of a square."
)
@click.option(
    "--marker-mm", type=FiniteRange(0.5, 1000), default=22.0, show_default=True, help="Side length of a marker."
)
@click.option("--dictionary", default="4X4_50", show_default=True, help="OpenCV name of the marker dictionary.")
@click.option("--legacy", is_flag=True, help="Board printed by OpenCV before 4.6, with an even number of rows.")
@click.option(
    "--views", type=click.IntRange(3, 500), default=30, show_default=True, help="Maximum number of views to use."
)
@click.option(
    "--least-views", type=click.IntRange(3, 500), default=8, show_default=True, help="Minimum number of views required."
)
@click.option(
    "--seconds", type=FiniteRange(1, 3600), default=60.0, show_default=True, help="Time to watch a live camera."
)
@json_option
def camera(
    sources: tuple[str, ...],
    out: Path | None,
    plot: Path | None,
    board: Path | None,
    columns: int,
    rows: int,
    square_mm: float,
    marker_mm: float,
    dictionary: str,
    legacy: bool,
    views: int,
    least_views: int,
    seconds: float,
    json_file: str | None,
) -> None:
    """Calibrate a camera with a ChArUco board.

    The calibration is needed for ground-truth poses (pose source aruco). --board writes the board to print.

    SOURCE is a picture, a folder or glob pattern of pictures, a video, a camera index, a /dev path or a URL. With a
    video or a live camera, move the board over the whole picture, near and far, and tilt it in both directions: a view
    is used only if it differs from the earlier ones. The command fails if there are too few views or if they are too
    similar.

    Takes: a second per picture; a live camera is filmed for --seconds.

    Writes: the file of --out, and those of --board, --plot and --json.

    \b
    Examples:
      lsds calibrate camera --board board.pdf --square-mm 30
      lsds calibrate camera 'views/*.png' --out camera.yaml --plot coverage.png
      lsds calibrate camera /dev/video2 --out camera.yaml --seconds 90
      lsds calibrate camera http://127.0.0.1:8080/?action=stream --out camera.json
      lsds calibrate camera board.mp4 --square-mm 29.7 --json -
    """
    from lsds.calibration.vision.board_views import BoardFinder
    from lsds.calibration.vision.board_views import calibrate as solve
    from lsds.calibration.vision.camera import save_camera
    from lsds.calibration.vision.fiducials import Board

    shape = Board(columns, rows, square_mm * 1e-3, marker_mm * 1e-3, legacy=legacy)
    if board is not None:
        _draw(board, shape, dictionary)
        return
    if not sources:
        raise click.UsageError(
            "SOURCE is missing: give pictures, a video or a camera, or --board FILE to write the board"
        )
    for target in (out, plot, json_file):
        require_writable(target)
    if out is not None and out.suffix.lower() not in (".yaml", ".yml", ".json", ".xml"):
        raise click.UsageError(f"--out {out}: the name must end in .yaml or .json")
    from lsds.cli.calibrate_views import collect

    finder = BoardFinder(shape, dictionary)
    found = collect(finder, sources, most=views, live_s=seconds)
    if finder.size is None or not found.views:
        raise DataError(
            f"no board found in {found.looked} pictures "
            f"(is it {columns} x {rows} squares, with markers of dictionary {dictionary}?)"
        )
    result = solve(found.views, finder.size, least_views=least_views)
    if out is not None:
        notes: dict[str, float | int | str] = {
            "avg_reprojection_error": result.error_px,
            "nr_of_views": len(found.views),
            "coverage": result.coverage,
        }
        save_camera(out, result.camera, notes)
    if plot is not None:
        from lsds.calibration.picture import plot_calibration

        plot_calibration(plot, result, found.views)
    summary = {
        "size_px": list(result.camera.size),
        "camera_matrix": result.camera.matrix.tolist(),
        "distortion_coefficients": result.camera.distortion.tolist(),
        "error_px": result.error_px,
        "std_px": dict(zip(("fx", "fy", "cx", "cy"), result.std_px, strict=True)),
        "coverage": result.coverage,
        "cells": result.cells.tolist(),
        "pictures": found.looked,
        "views": [
            {"name": v.name, "corners": len(v.pixels), "error_px": e}
            for v, e in zip(found.views, result.view_errors_px, strict=True)
        ],
    }
    if json_file is not None:
        write_json(summary, json_file)
    if json_file != "-":
        (fx, _, cx), (_, fy, cy), _ = result.camera.matrix.tolist()
        sx, sy, px, py = result.std_px
        lines = [
            ("views", f"{len(found.views)} of {found.looked} pictures, {result.coverage:.0%} of the picture covered"),
            ("error", f"{result.error_px:.3f} px RMS"),
            ("focal length", f"{fx:.2f} ± {sx:.2f}, {fy:.2f} ± {sy:.2f} px"),
            ("principal point", f"{cx:.2f} ± {px:.2f}, {cy:.2f} ± {py:.2f} px"),
            ("distortion", " ".join(f"{k:.4f}" for k in result.camera.distortion)),
        ]
        click.echo(table(lines, ("", "")).strip("\n"))
        click.echo(f"written to {out}" if out is not None else "not written: name a file with --out")


def _draw(path: Path, shape: object, dictionary: str) -> None:
    from lsds.calibration.picture import draw_board
    from lsds.calibration.vision.fiducials import Board

    assert isinstance(shape, Board)
    require_writable(path)
    if path.suffix.lower() not in (".png", ".pdf"):
        raise click.UsageError(f"--board {path}: the name must end in .png or .pdf")
    width, height = draw_board(path, shape, dictionary)
    click.echo(
        f"{path}: {width:.0f} x {height:.0f} mm; print it at 100 %, glue it to something flat, and measure a square"
    )
