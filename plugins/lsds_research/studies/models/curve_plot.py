"""Scores by the number of objects to learn from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lsds.session.pictures.figure import new_figure

if TYPE_CHECKING:
    from lsds.contracts.study import Value


def plot(path: Path, rows: list[dict[str, Value]], scores: Mapping[str, tuple[str, float]], title: str) -> None:
    """Write a PNG: one panel per score, one color per model; dashed: second dataset, dotted: trivial baseline."""
    figure = new_figure(3.6 * len(scores), 3.8)
    panels = figure.subplots(1, len(scores), squeeze=False)[0]
    models = list(dict.fromkeys(str(row["model"]) for row in rows))
    places = list(dict.fromkeys(str(row["on"]) for row in rows))
    for ax, (key, (heading, _)) in zip(panels, scores.items(), strict=True):
        for model in models:
            for on, line in zip(places, ("-", "--"), strict=False):
                own = [row for row in rows if row["model"] == model and row["on"] == on and row[key] is not None]
                color = f"C{models.index(model)}"
                if own and own[0]["objects"] is None:
                    ax.axhline(float(own[0][key] or 0), color=color, lw=1, ls=":" if line == "-" else "-.")
                    continue
                counts = sorted({int(row["objects"] or 0) for row in own})
                values = [[float(row[key] or 0) for row in own if row["objects"] == count] for count in counts]
                ax.plot(counts, [np.mean(value) for value in values], f"o{line}", color=color, ms=4)
                for count, value in zip(counts, values, strict=True):
                    ax.plot([count, count], [min(value), max(value)], color=color, lw=1, alpha=0.5)
        ax.set_xscale("log", base=2)
        ticks = sorted({int(row["objects"]) for row in rows if row["objects"] is not None})
        ax.set_xticks(ticks, [str(tick) for tick in ticks])
        ax.set_xlabel("objects to learn from")
        ax.set_title(heading, fontsize=10)
        ax.grid(alpha=0.3)
    for model in models:
        panels[0].plot([], [], "o-", color=f"C{models.index(model)}", label=model, ms=4)
    for on, line in zip(places, ("-", "--"), strict=False):
        panels[0].plot([], [], line, color="0.4", label=f"on {on}")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, fontsize=8, frameon=False)
    figure.suptitle(title, fontsize=10)
    figure.savefig(path, dpi=110)
