"""The chart of the study `realism`: a panel a quantity, real and simulated cumulative distributions; the relief."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from lsds_research.studies.realism.imprint import BANDS, MOTIONS, band_name
from lsds_research.studies.realism.quantities import QUANTITIES, Quantity

from lsds.session.pictures.figure import new_figure

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes

    from lsds.contracts.study import Value

STYLES = {"real": {"color": "black", "lw": 2.2}, "simulated": {"color": "tab:orange", "lw": 2.2}}
COLOURS = ("black", "tab:orange", "tab:blue")
SIGNED = ("divergence", "curl")


def plot(
    path: Path,
    curves: Mapping[str, Mapping[str, Any]],
    clips: Mapping[str, int],
    relief: Sequence[Mapping[str, Value]],
) -> None:
    """Write the chart as PNG; `clips` is their number of each kind, `relief` the rows of its table."""
    figure = new_figure(13, 10.4)
    above, below = figure.subfigures(2, 1, squeeze=False, height_ratios=(6.6, 3.8)).ravel()
    panels = above.subplots(2, 4, sharey=True)
    for ax, quantity in zip(panels.ravel(), QUANTITIES, strict=True):
        _panel(ax, quantity, curves[quantity.key])
    for ax in panels[:, 0]:
        ax.set_ylabel("share of values below")
    handles, names = panels[0, 0].get_legend_handles_labels()
    above.legend(
        handles,
        [f"{name} ({clips[name]} clips)" for name in names],
        loc="outside lower center",
        ncols=2,
        fontsize=12,
        frameon=False,
    )
    inside, beside, lasting = below.subplots(1, 3, width_ratios=(1.3, 1.3, 1))
    _bands(inside, relief, "contact", "Relief inside the contact")
    _bands(beside, relief, "free", "Relief beside the contact: camera, codec, dots")
    beside.sharey(inside)
    inside.set_ylabel("RMS curvature (1/mm)")
    _lasting(lasting, relief)
    below.legend(*inside.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=11, frameon=False)
    figure.suptitle("Recordings and simulated clips through the same tracker", fontsize=13)
    figure.savefig(path, dpi=100)


def _bands(ax: Axes, rows: Sequence[Mapping[str, Value]], place: str, title: str) -> None:
    """Median and quartiles over the clips of each side, by band."""
    names = [band_name(band) for band in BANDS]
    for number, of in enumerate(dict.fromkeys(str(row["of"]) for row in rows)):
        own = {row["cycles_per_mm"]: row for row in rows if row["relief"] == place and row["of"] == of}
        at = [name for name in names if own[name]["p50"] is not None]
        x = np.array([names.index(name) for name in at]) + 0.12 * (number - 1)
        low, middle, high = (np.array([float(own[name][p] or 0.0) for name in at]) for p in ("p25", "p50", "p75"))
        clips = max((int(own[name]["clips"] or 0) for name in at), default=0)
        label = f"{of} ({clips} clips with a contact)"
        ax.errorbar(x, middle, (middle - low, high - middle), marker="o", capsize=3, color=COLOURS[number], label=label)
    ax.set_yscale("log")
    ax.set_yticks(_CURVATURES, [f"{value:g}" for value in _CURVATURES])
    ax.minorticks_off()
    ax.set_xticks(range(len(names)), [name.replace(" to ", "-") for name in names])
    ax.set_xlabel("cycles per mm")
    ax.set_title(title, fontsize=10)
    ax.grid(alpha=0.25)


#: Ticks of the logarithmic scale, 1/mm.
_CURVATURES = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)


def _lasting(ax: Axes, rows: Sequence[Mapping[str, Value]]) -> None:
    """Median and quartiles of how the relief correlates with that of the next frame, moved along with the gel."""
    for number, of in enumerate(dict.fromkeys(str(row["of"]) for row in rows)):
        own = {row["relief"]: row for row in rows if row["of"] == of}
        for at, motion in enumerate(MOTIONS):
            low, middle, high = (own[f"kept, {motion}"][p] for p in ("p25", "p50", "p75"))
            if low is None or middle is None or high is None:
                continue
            low, middle, high = float(low), float(middle), float(high)
            x = at + 0.27 * (number - 1)
            ax.errorbar(x, middle, [[middle - low], [high - middle]], marker="o", capsize=3, color=COLOURS[number])
            ax.annotate(
                f"{middle:.3f}", (x, low), xytext=(0, -4), textcoords="offset points", fontsize=8, ha="center", va="top"
            )
    ax.set_xticks(range(len(MOTIONS)), [f"dots {motion}" for motion in MOTIONS])
    ax.set_xlim(-0.5, len(MOTIONS) - 0.4)
    ax.margins(y=0.12)
    ax.set_title("Correlation with the next frame's relief", fontsize=10)
    ax.grid(alpha=0.25, axis="y")


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
