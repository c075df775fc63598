"""The picture of a certificate: margins of the runs, and the interval as runs were added."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lsds.session.pictures.figure import new_figure
from lsds_research.certify.sequential import Estimate


def plot_certificate(path: Path, rows: Sequence[dict[str, Any]], estimate: Estimate) -> None:
    """Write the picture: slip against grip of each lift, sized by the share of the space that it stands for."""
    figure = new_figure(8, 4.5)
    axes = figure.add_subplot()
    sizes = 4 + 60 * estimate.weights / max(float(estimate.weights.max()), 1e-12)
    dropped = np.array([row["margin"] < 0 for row in rows])
    slip = np.array([_number(row.get("slip_m")) * 1e3 for row in rows])
    ratio = np.array([_number(row.get("ratio")) for row in rows])
    known = np.isfinite(slip) & np.isfinite(ratio)
    invalid = np.array([bool(row.get("invalid")) for row in rows])
    for own, colour, marker, label in (
        (known & ~dropped & ~invalid, "tab:blue", "o", "held"),
        (known & ~dropped & invalid, "0.6", "s", "in the grip, outside the model's validity"),
        (known & dropped, "tab:red", "X", "dropped"),
    ):
        axes.scatter(ratio[own], slip[own] + 0.01, s=sizes[own], c=colour, marker=marker, alpha=0.6, lw=0, label=label)
    axes.set_yscale("log")
    axes.set_xscale("log")
    axes.set_xlabel("grip over needed (steady; of a dropped object: the peak)")
    axes.set_ylabel("slip, mm (simulated)")
    interval = f"{estimate.least:.1%} to {estimate.most:.1%}"
    axes.set_title(f"probability of a drop {estimate.estimate:.1%} ({interval}), {estimate.runs} lifts", fontsize=10)
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=110)


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)
