"""The picture of a tracked recording: dots kept, motion, features, slip, and two frames."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lsds.session.pictures.figure import new_figure
from lsds.session.pictures.tactile_frame import draw_frame
from lsds.tactile.feature_sets import NAMES

if TYPE_CHECKING:
    from lsds.session.track import TrackResult


def plot_track(path: Path, result: TrackResult) -> None:
    """Write the picture. The result has to have a reference."""
    if result.reference is None or result.reference_frame is None:
        raise ValueError("there is no reference frame to draw")
    figure = new_figure(11, 9)
    grid = figure.add_gridspec(4, 3, width_ratios=[2, 2, 1.8])
    t = np.array(result.t_s)
    features = dict(zip(NAMES, np.array(result.features).reshape(-1, len(NAMES)).T, strict=True))
    scale = result.metres_per_px
    kept = figure.add_subplot(grid[0, :2])
    kept.plot(t, result.kept_fraction, color="tab:green")
    kept.set_ylim(-0.03, 1.05)
    kept.set_ylabel("dots kept")
    motion = figure.add_subplot(grid[1, :2], sharex=kept)
    motion.plot(t, features["mean_displacement"] / scale, label="mean displacement (px)")
    motion.plot(t, features["v_net"] / scale / 25, lw=0.9, label="v_net (px per 1/25 s)")
    motion.set_ylabel("motion")
    motion.legend(fontsize=8, loc="best")
    shape = figure.add_subplot(grid[2, :2], sharex=kept)
    shape.plot(t, features["div_mean"], label="divergence")
    shape.plot(t, features["curl_mean"], label="curl")
    shape.plot(t, features["area"], label="contact area (fraction)")
    shape.set_ylabel("features")
    shape.legend(fontsize=8, loc="best")
    slip = figure.add_subplot(grid[3, :2], sharex=kept)
    slip.plot(t, 100 * np.array(result.speed_m_s), color="tab:orange", label="estimated slip speed")
    alarms = t[[s is True for s in result.slip]]
    slip.plot(alarms, np.zeros(len(alarms)), "|", color="tab:red", ms=8, label="slip detected")
    slip.set_ylabel("cm/s")
    slip.set_xlabel(f"time (s, {result.timestamps})")
    slip.legend(fontsize=8, loc="best")
    for axes in (kept, motion, shape, slip):
        axes.grid(alpha=0.25)
    draw_frame(figure.add_subplot(grid[:2, 2]), result.reference_frame, result.reference, None, "reference")
    if result.worst is not None:
        frame, tracks, reference = result.worst
        title = f"largest displacement, frame {frame.seq}"
        draw_frame(figure.add_subplot(grid[2:, 2]), frame, reference, tracks, title)
    name = Path(result.source).name
    figure.suptitle(f"{name}: {result.reference.count} dots, {len(t) + 1} frames", fontsize=11)
    figure.savefig(path, dpi=110)
