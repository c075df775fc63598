"""The chart of the study `loop`: time against slip, and time against steady grip, with the front."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lsds.session.pictures.figure import new_figure

_PANELS = (("slip_mm", "slip (mm, simulated)"), ("steady", "steady grip over what is needed (simulated)"))
_COLOURS = {"belief": "tab:blue", "pd": "tab:orange"}


def plot_loop(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write the chart: one point per configuration; the points of the front are joined and named."""
    from matplotlib.ticker import LogLocator

    figure = new_figure(11.5, 5.2)
    panels = figure.subplots(1, 2, squeeze=False)[0]
    for panel, (name, label) in zip(panels, _PANELS, strict=True):
        for law in sorted({row["controller"] for row in rows}):
            own = [row for row in rows if row["controller"] == law and row[name] is not None]
            colour = _COLOURS.get(law, "tab:green")
            held = [row for row in own if row["held"] == 1]
            lost = [row for row in own if row["held"] < 1]
            panel.plot([r["frame_us"] for r in held], [r[name] for r in held], "o", ms=5, color=colour, label=law)
            panel.plot([r["frame_us"] for r in lost], [r[name] for r in lost], "x", ms=5, color=colour)
        front = sorted((r for r in rows if r["held"] == 1 and r[name] is not None), key=lambda r: r["frame_us"])
        best: list[dict[str, Any]] = []
        for row in front:
            if not best or row[name] < best[-1][name]:
                best.append(row)
        panel.step([r["frame_us"] for r in best], [r[name] for r in best], where="post", color="0.6", lw=1, zorder=0)
        for at, row in enumerate(best):
            budget = f" {row['budget_ms']:g} ms" if row["budget_ms"] else ""
            text = f"{row['tracker']} {row['detector']}+{row['estimator']}{budget}"
            above = at % 2 == 0
            panel.annotate(
                text,
                (row["frame_us"], row[name]),
                (5, 6) if above else (-5, -7),
                textcoords="offset points",
                fontsize=7,
                rotation=20,
                ha="left" if above else "right",
                va="bottom" if above else "top",
                rotation_mode="anchor",
            )
        for row in rows:
            if row["default"] and row[name] is not None:
                panel.plot(
                    row["frame_us"], row[name], "o", ms=12, mfc="none", mec="black", mew=1.2, label="the default"
                )
        panel.set_xscale("log")
        panel.set_yscale("log")
        for axis in (panel.xaxis, panel.yaxis):
            axis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter("{x:g}")
        panel.tick_params(which="both", labelsize=7)
        panel.set_xlabel("image to command (us, mean, this machine)")
        panel.set_ylabel(label)
        panel.grid(alpha=0.25, which="both")
        panel.margins(x=0.25, y=0.2)
    panels[0].legend(fontsize=8, title="controller; x: dropped some", title_fontsize=8)
    figure.savefig(path, dpi=110)
