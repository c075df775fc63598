"""The chart of the study `gel`: a panel per scene with error against time, and the results of the automatic gel."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.session.pictures.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from lsds.contracts.study import Value

STYLES = {
    "affine": ("v", "tab:gray"),
    "winkler": ("^", "tab:brown"),
    "half-space": ("s", "tab:red"),
    "layer": ("D", "tab:orange"),
    "pad": ("o", "tab:blue"),
    "auto": ("*", "tab:green"),
}
FLOOR_UM = 1.0
"""Error of the dots below which differences are not significant, um: about the uncertainty of the reference."""


def draw(path: Path, rows: list[dict[str, Value]], chosen: list[dict[str, Value]]) -> None:
    """Write the chart as PNG."""
    scenes = list(dict.fromkeys(str(row["scene"]) for row in rows))
    panels = len(scenes) + bool(chosen)
    columns = min(4, panels)
    lines = -(-panels // columns)
    figure = new_figure(3.6 * columns, 3.3 * lines + 0.5)
    axes = list(np.ravel(figure.subplots(lines, columns, squeeze=False)))
    for ax, scene in zip(axes, scenes, strict=False):
        _scene(ax, scene, [row for row in rows if row["scene"] == scene])
    if chosen:
        _choices(axes[len(scenes)], chosen)
    for ax in axes[panels:]:
        ax.set_visible(False)
    handles = {label.split(" ")[0]: (style, colour) for label, (style, colour) in STYLES.items()}
    marks = [axes[0].plot([], [], style, color=colour, label=name)[0] for name, (style, colour) in handles.items()]
    figure.legend(handles=marks, loc="outside lower center", ncols=len(marks), fontsize=9, frameon=False)
    figure.suptitle("Gel models, simulated: RMS error of the dots against time a frame, one thread", fontsize=11)
    figure.savefig(path, dpi=120)


def _scene(ax: Axes, scene: str, rows: list[dict[str, Value]]) -> None:
    for row in rows:
        style, colour = STYLES[str(row["model"]).split(" ")[0]]
        x, y = float(row["us_p50"] or 0), float(row["rms_um"] or 0)
        ax.plot(x, y, style, color=colour, ms=9 if style == "*" else 6)
        if row["pitch_mm"] or style == "*":
            label = str(row["model"]).split(" ", 1)[1]
            # Points of the automatic gel often coincide.
            side: dict[str, Any] = (
                {"xytext": (0, 7 if label.startswith("20") else -12), "ha": "center"}
                if style == "*"
                else {"xytext": (5, 4)}
            )
            ax.annotate(label, (x, y), textcoords="offset points", fontsize=7, color=colour, **side)
    pads = sorted((float(r["us_p50"] or 0), float(r["rms_um"] or 0)) for r in rows if str(r["model"]).startswith("pad"))
    ax.plot(*zip(*pads, strict=True), "-", color=STYLES["pad"][1], lw=1, alpha=0.6) if pads else None
    ax.axhspan(1e-2, FLOOR_UM, color="0.92", zorder=0)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(20, 2e5)
    ax.set_ylim(0.1, 600)
    ax.set_title(f"{scene} (against {rows[0]['truth']})", fontsize=9)
    ax.set_xlabel("us a frame, median", fontsize=8)
    ax.set_ylabel("um RMS", fontsize=8)
    ax.tick_params(labelsize=7)
    ax.grid(alpha=0.25, which="major")


def _choices(ax: Axes, chosen: list[dict[str, Value]]) -> None:
    for row in chosen:
        x, y = float(row["rms_um"] or 0) / float(row["tolerance_um"] or 1), float(row["cost_ratio"] or 0)
        ax.plot(x, y, "o" if row["met"] else "x", color="tab:green" if row["met"] else "tab:red", ms=4, alpha=0.7)
    ax.axvline(1.0, color="0.4", lw=1, ls=":")
    ax.axhline(2.0, color="0.4", lw=1, ls=":")
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel("error / tolerance", fontsize=8)
    ax.set_ylabel("cost / cheapest that meets it", fontsize=8)
    ax.set_title("auto on random scenes, audits included", fontsize=9)
    ax.tick_params(labelsize=7)
    ax.grid(alpha=0.25)
