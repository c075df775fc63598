"""The chart of the study `realism`: a panel a quantity, real and simulated cumulative distributions."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.plots.figure import new_figure
from lsds_research.studies.realism.quantities import QUANTITIES, Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes

STYLES = {"real": {"color": "black", "lw": 2.2}, "simulated": {"color": "tab:orange", "lw": 2.2}}
SIGNED = ("divergence", "curl")


def plot(path: Path, curves: Mapping[str, Mapping[str, Any]], clips: Mapping[str, int]) -> None:
    """Write the chart as PNG; `clips` is their number of each kind."""
    figure = new_figure(13, 6.6)
    for ax, quantity in zip(figure.subplots(2, 4, sharey=True).ravel(), QUANTITIES, strict=True):
        _panel(ax, quantity, curves[quantity.key])
    for row in (0, 4):
        figure.axes[row].set_ylabel("share of values below")
    handles, names = figure.axes[0].get_legend_handles_labels()
    figure.legend(
        handles,
        [f"{name} ({clips[name]} clips)" for name in names],
        loc="outside lower center",
        ncols=2,
        fontsize=12,
        frameon=False,
    )
    figure.suptitle("Recordings and simulated clips through the same tracker", fontsize=13)
    figure.savefig(path, dpi=100)


def _panel(ax: Axes, quantity: Quantity, curve: Mapping[str, Any]) -> None:
    levels = curve["levels"]
    for name, style in STYLES.items():
        ax.plot(curve[name], levels, label=name, **style)  # type: ignore[arg-type]
    # Linear up to the floor, where there is nothing but noise, logarithmic beyond: zero and both signs have a place.
    ax.set_xscale("symlog", linthresh=quantity.floor, linscale=0.5)
    at = (levels >= 0.4) & (levels <= 99.6)
    high = max(quantity.floor, *(float(np.abs(curve[name][at]).max()) for name in STYLES))
    decades = [10.0**power for power in range(math.ceil(math.log10(quantity.floor)), math.floor(math.log10(high)) + 1)]
    if quantity.key in SIGNED:
        ax.set_xlim(-1.2 * high, 1.2 * high)
        ax.set_xticks([-d for d in reversed(decades)] + [0.0, *decades])
        ax.axvline(0, color="0.7", lw=0.8, zorder=0)
    else:
        ax.set_xlim(0, 1.2 * high)
        ax.set_xticks([0.0, *decades])
    ax.minorticks_off()
    ax.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
    ax.axhspan(5, 95, color="0.95", zorder=0)
    ax.yaxis.set_major_formatter("{x:g}%")
    ax.set_yticks([5, 25, 50, 75, 95])
    ax.set_ylim(-1, 101)
    ax.set_title(f"{quantity.name}\noverlap {curve['overlap']:.2f}", fontsize=10)
    ax.set_xlabel(quantity.unit if quantity.unit != "1" else "no unit")
    ax.grid(alpha=0.25)
