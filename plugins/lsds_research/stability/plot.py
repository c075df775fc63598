"""The picture of a map: one panel per method, coloured by its figure, with a cross at each point that fails."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lsds.session.pictures.figure import new_figure
from lsds_research.stability.grid import StabilityMap

if TYPE_CHECKING:
    from lsds.contracts.study import Value

PANEL_COLUMNS = 4
"""Maximum number of panels side by side; chosen."""
SAFE, NAIVE = "#1a6b34", "#8a2b0f"


def plot_map(path: Path, of: StabilityMap, rows: Sequence[dict[str, Value]]) -> None:
    """Write the map as PNG. Crosses stand where a point fails; a naive method's name is brown."""
    methods = list(dict.fromkeys(str(row["method"]) for row in rows))
    xs, ys = (sorted({float(row[axis] or 0) for row in rows}) for axis in ("x", "y"))
    across = min(PANEL_COLUMNS, len(methods))
    down = math.ceil(len(methods) / across)
    figure = new_figure(2.0 + 2.6 * across, 1.1 + 2.4 * down)
    panels = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True)
    figures = {
        (row["method"], row["x"], row["y"]): math.inf if row["figure"] is None else float(row["figure"]) for row in rows
    }
    curves = of.curves() if of.curves else ()
    mesh = None
    for index, ax in enumerate(panels.flat):
        if index >= len(methods):
            ax.set_visible(False)
            continue
        method = methods[index]
        table = np.array([[figures.get((method, x, y), math.nan) for x in xs] for y in ys])
        # The limit is at the middle of the colours; 1 is twice the limit and more.
        shade = np.clip(table / (2 * of.limit), 0, 1)
        mesh = ax.imshow(shade, origin="lower", aspect="auto", cmap="RdYlGn_r", vmin=0, vmax=1)
        for row, column in np.argwhere(~(table <= of.limit)):
            ax.plot(column, row, "x", color="black", ms=4, mew=0.8)
        safe = float(np.mean(table <= of.limit))
        ax.set_title(f"{method}: {100 * safe:.0f} % safe", fontsize=9, color=NAIVE if method in of.naive else SAFE)
        _ticks(ax.set_xticks, xs)
        _ticks(ax.set_yticks, ys)
        ax.tick_params(labelsize=7, labelbottom=index + across >= len(methods))
        for label, points in ((label, points) for about, label, points in curves if about == method):
            across_x, across_y = (
                [_place(point[axis], values) for point in points] for axis, values in ((0, xs), (1, ys))
            )
            if outside := all(x in (-0.5, len(xs) - 0.5) for x in across_x):
                label += " (outside)"
            ax.plot(across_x, across_y, "--" if outside else "-", color="navy", lw=1.2, label=label, clip_on=False)
            ax.legend(fontsize=6, loc="upper right")
    figure.supxlabel(of.x.label, fontsize=9)
    figure.supylabel(of.y.label, fontsize=9)
    figure.suptitle(f"{of.title}, simulated; x: fails", fontsize=10)
    if mesh is not None:
        bar = figure.colorbar(mesh, ax=panels, ticks=[0, 0.5, 1], fraction=0.03)
        bar.ax.set_yticklabels(["0", f"limit {of.limit:g}", f"{2 * of.limit:g}+"], fontsize=7)
        bar.set_label(f"{of.figure}{' (' + of.unit + ')' if of.unit else ''}", fontsize=8)
    figure.savefig(path, dpi=110)


def _place(value: float, values: Sequence[float]) -> float:
    """Return where a value lies on an axis of columns; beyond the map it is at the edge."""
    if not values[0] <= value <= values[-1]:
        return -0.5 if value < values[0] else len(values) - 0.5
    return float(np.interp(value, values, range(len(values))))


def _ticks(put: object, values: Sequence[float]) -> None:
    every = max(1, math.ceil(len(values) / 7))
    places = list(range(0, len(values), every))
    put(places, [f"{values[at]:g}" for at in places])  # type: ignore[operator]
