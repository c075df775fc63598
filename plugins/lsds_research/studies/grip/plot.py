"""The chart of the study `grip`: slip against steady grip, one panel a controller."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lsds.session.pictures.figure import new_figure

LEAST_MM = 0.02
"""Slip at which smaller slips are drawn on the logarithmic axis, mm; chosen."""


def plot_grip(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write the chart: each run a point, dropped ones as crosses below the others."""
    names = sorted({row["controller"] for row in rows})
    figure = new_figure(4.2 * len(names) + 0.6, 4.6)
    panels = figure.subplots(1, len(names), sharex=True, sharey=True, squeeze=False)[0]
    most = max((row["peak_over_needed"] for row in rows), default=1.0)
    furthest_mm = max((row["slip_mm"] for row in rows), default=LEAST_MM)
    for panel, name in zip(panels, names, strict=True):
        own = [row for row in rows if row["controller"] == name]
        held = [row for row in own if row["held"] and row["steady_over_needed"] is not None]
        lost = [row for row in own if not row["held"]]
        slip = [max(row["slip_mm"], LEAST_MM) for row in held]
        steady = [row["steady_over_needed"] for row in held]
        peak = [row["peak_over_needed"] for row in held]
        panel.vlines(slip, steady, peak, color="0.8", lw=0.8)
        panel.plot(slip, steady, "o", ms=3.5, color="tab:blue", label="steady; grey: up to the peak")
        if lost:
            lost_mm = [max(row["slip_mm"], LEAST_MM) for row in lost]
            panel.plot(lost_mm, [0.7] * len(lost), "x", color="tab:red", label="dropped")
            panel.legend(fontsize=8, loc="upper right")
        panel.axhline(1.0, color="k", lw=0.8)
        panel.axhline(1.4, color="0.5", lw=0.8, ls=":")
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_xlim(0.9 * LEAST_MM, 1.2 * max(furthest_mm, 1.0))
        panel.set_ylim(0.6, 1.2 * most)
        panel.set_yticks([1, 1.4, 2, 5, 10, 20], ["1", "1.4", "2", "5", "10", "20"])
        panel.minorticks_off()
        panel.set_title(f"{name}: {len(held)} of {len(own)} held", fontsize=10)
        panel.set_xlabel("slip (mm); left edge: none")
        panel.grid(alpha=0.25)
    panels[0].set_ylabel("normal force over what is needed (simulated)")
    panels[0].legend(fontsize=8, loc="upper right")
    figure.savefig(path, dpi=110)
