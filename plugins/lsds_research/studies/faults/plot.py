"""The chart of the study `faults`: a tile for each fault, moment and severity."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lsds.session.pictures.figure import new_figure

COLOURS = {
    "harmless": "#cfe8cf",
    "squeezed": "#f2dd8a",
    "stopped": "#7fa8d9",
    "missed": "#d9534f",
    "unnamed": "#4a1a4f",
}


def plot_faults(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write the chart: rows are faults, columns moments and, within them, severities; the worst seed counts."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    names = sorted({row["fault"] for row in rows})
    order = ["approach", "squeeze", "take up", "lift", "slip", "hold"]
    moments = [moment for moment in order if any(row["moment"] == moment for row in rows)]
    severities = sorted({row["severity"] for row in rows if row["severity"]}) or [0]
    words = list(COLOURS)
    tiles = np.full((len(names), len(moments) * len(severities)), np.nan)
    for row in rows:
        word = "squeezed" if row["verdict"] == "harmless" and row["squeezed"] else row["verdict"]
        first = moments.index(row["moment"]) * len(severities)
        own = range(len(severities)) if not row["severity"] else [severities.index(row["severity"])]
        for at in own:
            tile = names.index(row["fault"]), first + at
            tiles[tile] = (
                np.nanmax([tiles[tile], words.index(word)]) if not np.isnan(tiles[tile]) else words.index(word)
            )
    figure = new_figure(max(6.5, 3.2 + 0.28 * tiles.shape[1]), 2.4 + 0.19 * len(names))
    axes = figure.add_subplot()
    axes.pcolormesh(tiles, cmap=ListedColormap([*COLOURS.values()]), vmin=-0.5, vmax=len(words) - 0.5, ec="w", lw=0.5)
    axes.invert_yaxis()
    axes.set_yticks(np.arange(len(names)) + 0.5, names, fontsize=7)
    axes.set_xticks(np.arange(tiles.shape[1]) + 0.5, [str(s or "") for s in severities] * len(moments), fontsize=7)
    for at, moment in enumerate(moments):
        axes.axvline(at * len(severities), color="k", lw=0.8)
        axes.text((at + 0.5) * len(severities), -0.4, moment, ha="center", va="bottom", fontsize=8)
    axes.set_xlabel("severity, by the moment at which the fault begins; simulated")
    handles = [Patch(color=colour, label=word) for word, colour in COLOURS.items()]
    figure.legend(handles=handles, fontsize=8, ncols=len(words), loc="outside lower center")
    figure.savefig(path, dpi=110)
