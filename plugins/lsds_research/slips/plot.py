"""The picture of the study `slip`: intervals noticed against false alarms while the gel moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from lsds.session.pictures.figure import new_figure


def draw(path: Path, curves: Mapping[str, Sequence[tuple[float, float]]], alarms: float, title: str) -> None:
    """Write the picture, the best detector at `alarms` false alarms first."""
    figure = new_figure(9, 6)
    axes = figure.subplots()

    def share(name: str) -> float:
        return max((noticed for false, noticed in curves[name] if false <= alarms), default=0.0)

    for number, name in enumerate(sorted(curves, key=share, reverse=True)):
        false, noticed = zip(*curves[name], strict=True)
        style = "-" if "imprint" in name or "fused" in name else "--"
        axes.plot(false, noticed, style, marker="o", ms=3, lw=2.2 if number == 0 else 1.3, label=name)
    axes.axvline(alarms, color="0.8", lw=1, zorder=0)
    axes.set_xscale("log")
    axes.set_ylim(0, 1.02)
    axes.set_xlabel("false alarms per 100 frames in which object and gel move together")
    axes.set_ylabel("share of slips noticed within two frames of their onset")
    axes.set_title(title, fontsize=10)
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=110)
