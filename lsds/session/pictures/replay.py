"""The picture of a replay: what was recorded, and what the algorithms say now."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.errors import DataError
from lsds.session.recording.messages import CORRECTION
from lsds.support.extras import require

if TYPE_CHECKING:
    from lsds.session.replay import ReplayResult

SLIP, SPEED, LOAD, APERTURE = "P(slip)", "slip speed, cm/s", "load and limit, N a finger", "aperture, mm"
APERTURE_ROOM_MM = 0.3
"""Room above and below the apertures, mm."""
FREE_SHARE = 0.03
"""Part of the time axis that is left free on either side."""


def draw_replay(path: Path, result: ReplayResult) -> None:
    """Draw a replay and its recording to a PNG. Raises DataError where it cannot be written."""
    require("matplotlib", extra="plot", purpose="a picture")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 8), layout="constrained")
    axes = figure.subplots(4, 1, sharex=True)
    recorded, replayed = _Series(result.recorded), _Series(result.replayed)
    _lines(axes[0], "/grip", "slips", 1.0, recorded, replayed)
    _lines(axes[1], "/estimate", "speed_m_s", 100.0, recorded, replayed)
    _lines(axes[2], "/grip", "load_n", 1.0, recorded, replayed)
    for series, style, name in ((recorded, "-", "recorded"), (replayed, "--", "replayed")):
        axes[2].plot(*series.of("/grip", "limit_n"), style, color="tab:red", lw=1, label=f"limit, {name}")
    axes[3].plot(*recorded.of("/cycle", "held_m", 1e3), color="0.4", lw=1.4, label="commanded, recorded")
    for series, marker, name in ((recorded, "o", "recorded"), (replayed, "x", "replayed")):
        axes[3].plot(*series.of(CORRECTION, "wanted_m", 1e3), marker, ms=5, mfc="none", label=f"wanted, {name}")
    for each, label in zip(axes, (SLIP, SPEED, LOAD, APERTURE), strict=True):
        each.set_ylabel(label)
        each.grid(alpha=0.25)
        each.legend(fontsize=7, loc="upper right")
    axes[0].set_ylim(-0.03, 1.03)
    _limit(axes[2])
    acting = recorded.of("/grip", "slips")[0]
    known = [at for at, value in zip(*recorded.of("/grip", "slips"), strict=True) if math.isfinite(value)]
    if known:
        span = max(acting) - known[0]
        axes[3].set_xlim(known[0] - FREE_SHARE * span, max(acting) + FREE_SHARE * span)
        times, held = recorded.of("/cycle", "held_m", 1e3)
        shown = [value for at, value in zip(times, held, strict=True) if at >= known[0] and math.isfinite(value)]
        shown += [value for series in (recorded, replayed) for value in series.of(CORRECTION, "wanted_m", 1e3)[1]]
        if shown:
            axes[3].set_ylim(min(shown) - APERTURE_ROOM_MM, max(shown) + APERTURE_ROOM_MM)
    axes[3].set_xlabel("time since the recording began, s")
    changed = ", ".join(result.changed) or "nothing changed"
    figure.suptitle(f"{Path(result.source).name}, {changed}", fontsize=10)
    try:
        figure.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: the picture cannot be written: {error}") from error


class _Series:
    """Numbers of a run by topic and field."""

    def __init__(self, rows: list[dict[str, Any]]) -> None:
        self._rows = rows

    def of(self, topic: str, name: str, scale: float = 1.0) -> tuple[list[float], list[float]]:
        """Return times (s) and values, NaN where unknown."""
        found = [(row["s"], row[name]) for row in self._rows if row["topic"] == topic]
        times = [at for at, _ in found]
        return times, [math.nan if not isinstance(value, int | float) else scale * value for _, value in found]


def _lines(axis: Any, topic: str, name: str, scale: float, recorded: _Series, replayed: _Series) -> None:
    axis.plot(*recorded.of(topic, name, scale), color="tab:blue", lw=1.6, label="recorded")
    axis.plot(*replayed.of(topic, name, scale), "--", color="tab:orange", lw=1.2, label="replayed")


def _limit(axis: Any) -> None:
    """Choose the range of the forces: a friction limit that is not known yet may be far away."""
    loads = np.concatenate([np.asarray(line.get_ydata(), float) for line in axis.lines[:2]] or [np.empty(0)])
    loads = loads[np.isfinite(loads)]
    if len(loads):
        axis.set_ylim(0, 3 * max(float(loads.max()), 0.1))
