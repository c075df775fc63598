"""The chart of the study `frame`: where a frame's time goes, and trackers' speed against their accuracy."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lsds.session.pictures.figure import new_figure
from lsds_research.studies.frame.cost import FrameCost


def plot_frame_cost(path: Path, cost: FrameCost) -> None:
    """Write the chart."""
    figure = new_figure(12, 5.8)
    bars, scatter = figure.subplots(1, 2)
    parts = [cost.total, *cost.parts, *cost.depth, *cost.peers]
    y = np.arange(len(parts))[::-1]
    between = len(parts) - 1 - len(cost.peers)
    # A step of a part is named below the part, indented.
    inner = ["0.82" if part.name.startswith(" ") else "0.6" for part in parts[1 : 1 + between]]
    colours = ["tab:blue", *inner, *["tab:orange"] * len(cost.peers)]
    bars.barh(y, [p.p50_us for p in parts], color=colours)
    bars.plot([p.p99_us for p in parts], y, "|", color="tab:red", ms=9, label="99th percentile")
    bars.set_yticks(y, [p.name for p in parts], fontsize=8)
    for row, part in zip(y, parts, strict=True):
        label = bars.text(part.p50_us, row, f" {part.p50_us:.0f}", va="center", fontsize=7)
        label.set_bbox({"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.4})
    bars.axvline(500, color="0.4", ls=":", lw=1)
    bars.set_xscale("log")
    bars.set_xlabel("microseconds (median), one core; light: steps of a part, orange: peers")
    bars.legend(fontsize=8, loc="lower left", bbox_to_anchor=(0, 1), frameon=False, borderpad=0)
    side = False
    for score in cost.trackers:
        colour = "tab:orange" if score.peer else "tab:blue"
        scatter.plot(score.p50_us, score.rms_px, "s" if score.peer else "o", color=colour)
        text = f"{score.name}\njumps: {100 * score.jump_wrong_unflagged:.0f} % wrong, unflagged"
        place = (0, -9) if side else (0, 9)
        side = not side
        scatter.annotate(
            text,
            (score.p50_us, score.rms_px),
            xytext=place,
            textcoords="offset points",
            fontsize=8,
            ha="center",
            va="top" if place[1] < 0 else "bottom",
        )
    scatter.set_xscale("log")
    scatter.set_yscale("log")
    scatter.margins(x=0.3, y=0.25)
    scatter.set_xlabel("microseconds a frame (median)")
    scatter.set_ylabel("RMS error against the simulated truth (px)")
    scatter.grid(alpha=0.3, which="both")
    figure.suptitle(f"One frame, {cost.frames} frames of a simulated run, seed {cost.seed}", fontsize=11)
    figure.savefig(path, dpi=110)
