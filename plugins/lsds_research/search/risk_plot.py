"""The picture of a probability: margins of each level, from uniform scenarios to failures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lsds.session.pictures.figure import new_figure


def plot_risk(path: Path, margins: Sequence[Sequence[float]], limits: Sequence[float]) -> None:
    """Write the picture: each run's margin in the order of the runs, and where each level began."""
    figure = new_figure(8, 4.5)
    axes = figure.add_subplot()
    margin = np.concatenate([np.asarray(batch, float) for batch in margins])
    failed = margin < 0
    at = np.arange(len(margin))
    axes.plot(at[~failed], margin[~failed], ".", ms=4, color="tab:blue", label="not failed")
    axes.plot(at[failed], margin[failed], "x", color="tab:red", label="failed")
    for number, limit in enumerate(limits, start=1):
        axes.axhline(limit, color="0.6", lw=0.8)
        axes.annotate(f"level {number}", (1, limit), xycoords=("axes fraction", "data"), fontsize=8, va="center")
    axes.axhline(0, color="k", lw=0.8)
    axes.set_xlabel("run")
    axes.set_ylabel("margin: 1 is best, below 0 a failure (simulated)")
    axes.legend(fontsize=8, loc="best")
    axes.grid(alpha=0.25)
    figure.savefig(path, dpi=110)
