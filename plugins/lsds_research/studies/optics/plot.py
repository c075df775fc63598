"""The chart of the study `optics`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lsds.session.pictures.figure import new_figure

if TYPE_CHECKING:
    from lsds.contracts.study import Value


def draw(path: Path, rows: list[dict[str, Value]]) -> None:
    """Write the chart as PNG: error over time, one colour per scene, one sign per tier."""
    figure = new_figure(9, 4.8)
    left, right = figure.subplots(1, 2)
    tiers = list(dict.fromkeys(str(row["tier"]) for row in rows))
    names = list(dict.fromkeys(str(row["scene"]) for row in rows))
    for index, name in enumerate(names):
        own = [row for row in rows if row["scene"] == name]
        us, levels = [float(row["image_us"] or 0) for row in own], [float(row["l1_levels"] or 0) for row in own]
        left.plot(us, levels, "-", color=f"C{index}", lw=0.8, alpha=0.6)
        for x, y, marker in zip(us, levels, "osD", strict=False):
            left.plot(x, y, marker, color=f"C{index}", ms=6)
    for tier, marker in zip(tiers, "osD", strict=True):
        left.plot([], [], marker, color="0.4", label=tier)
    left.set_yscale("symlog", linthresh=0.5)
    left.set_xlim(left=0)
    left.set_xlabel("time of the image (us)")
    left.set_ylabel("mean error in contact (grey levels)")
    left.legend(frameon=False, title="optics")
    linear = [row for row in rows if row["tier"] == "linear"]
    place = np.arange(len(linear))
    mechanics = np.array([float(row["mechanics_us"] or 0) for row in linear]) / 1e3
    image = np.array([float(row["image_us"] or 0) for row in linear]) / 1e3
    right.bar(place, mechanics, color="C0", label="mechanics")
    right.bar(place, image, bottom=mechanics, color="C1", label="image, linear")
    right.plot(place, [float(row["frame_p99_us"] or 0) / 1e3 for row in linear], "_", color="k", ms=14, label="p99")
    right.set_xticks(place, [str(row["scene"]) for row in linear], rotation=30)
    right.set_ylabel("a finger's frame (ms)")
    right.legend(frameon=False)
    for ax in (left, right):
        ax.grid(alpha=0.3)
    for index, label in enumerate(right.get_xticklabels()):
        label.set_color(f"C{index}")
    figure.suptitle("Simulated tactile image: computing time and colour error", fontsize=11)
    figure.savefig(path, dpi=110)
