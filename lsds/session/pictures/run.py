"""`run.png`: what happened in a run, on one page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.clock import seconds
from lsds.session.pictures.figure import new_figure
from lsds.session.pictures.tactile_frame import draw_frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from lsds.contracts import CellTruth, Cycle, Frame, MarkerReference
    from lsds.session.record import RunRecord, Sample

_STAGE_SHADE = {
    "grasp": "0.96",
    "approach": "0.98",
    "back off": "0.95",
    "touch": "0.98",
    "squeeze": "0.95",
    "settle": "0.92",
    "take up": "#d9e8f6",
    "lift": "#e8f1fa",
    "hold": "#f3f8ec",
}
LETTER = 0.011
"""Share of the time axis that a letter of a stage's name takes."""
LEAD = 0.12
"""Share of the time axis before the lift: the approach is long, and shows nothing of the grip."""


def plot_run(
    path: Path,
    record: RunRecord,
    truths: Sequence[CellTruth],
    reference_frame: Frame,
    reference: MarkerReference,
    summary: dict[str, Any],
) -> None:
    """Write the picture: aperture, slip speed, forces and belief over time, the first and the worst tactile frame."""
    samples = record.samples
    believes = any(math.isfinite(s.slip_probability) for s in samples)
    rows = 4 if believes else 3
    figure = new_figure(11, 8.5 * rows / 3)
    grid = figure.add_gridspec(rows, 3, width_ratios=[2.2, 2.2, 1.6])
    aperture = figure.add_subplot(grid[0, :2])
    speed, force, *belief = (figure.add_subplot(grid[row, :2], sharex=aperture) for row in range(1, rows))
    start = samples[0].t_ns
    t = np.array([seconds(s.t_ns - start) for s in samples])
    window = _window(samples, t)
    for axes in (aperture, speed, force, *belief):
        _shade_stages(axes, samples, t, window, named=axes is aperture)
        axes.grid(alpha=0.25)
    aperture.set_xlim(*window)

    aperture.plot(t, [1e3 * s.measured_m for s in samples], color="tab:blue", label="measured")
    aperture.step(t, [1e3 * s.held_m for s in samples], where="post", color="tab:orange", lw=1, label="commanded")
    aperture.set_ylabel("aperture (mm)")
    _zoom_on_grip(aperture, samples)
    aperture.legend(loc="best", fontsize=8)

    truth_t = np.array([seconds(truth.t_ns - start) for truth in truths])
    estimated = np.array([100 * s.speed_m_s for s in samples])
    spread = np.array([100 * s.speed_std_m_s for s in samples])
    speed.fill_between(t, np.maximum(estimated - spread, 0), estimated + spread, color="tab:orange", alpha=0.25, lw=0)
    speed.plot(t, estimated, color="tab:orange", label="estimated ± 1 sigma")
    if truths:
        true = [100 * math.hypot(*truth.slip_velocity_m_s) for truth in truths]
        speed.plot(truth_t, true, color="k", lw=1.2, label="true")
    called = t[[bool(s.called_slip) for s in samples]]
    speed.plot(called, np.full(len(called), -0.25), "|", color="tab:red", ms=9, label="called slip")
    speed.set_ylim(-0.5, _top([100 * v for s in samples if s.acting for v in (s.speed_m_s, s.true_speed_m_s)]))
    speed.set_ylabel("slip speed (cm/s)")
    speed.legend(loc="best", fontsize=8)

    if truths:
        force.plot(truth_t, [truth.normal_force_n for truth in truths], color="tab:blue", label="normal force a finger")
        force.plot(truth_t, [truth.required_normal_force_n for truth in truths], "k--", lw=1, label="needed to hold")
        force.legend(loc="best", fontsize=8)
        force.set_ylabel("force (N)")
    else:
        area = [s.contact_fraction for s in samples]
        force.plot(t, area, color="tab:green")
        force.set_ylabel("contact area (fraction)")
    for axes in belief:
        _draw_belief(axes, samples, t)
    (belief or [force])[0].set_xlabel("time since the first frame, s")

    draw_frame(figure.add_subplot(grid[0, 2]), reference_frame, reference, None, "reference")
    for row, cycle, name in ((1, record.first, "start of the lift"), (2, record.worst, "worst slip")):
        if cycle is not None:
            title = f"{name}, t = {seconds(cycle.t_ns - start):.2f} s"
            draw_frame(figure.add_subplot(grid[row, 2]), cycle.frame, reference, cycle.tracks, title)
    if believes and record.worst is not None:
        _draw_other_finger(figure.add_subplot(grid[3, 2]), record.worst)
    figure.suptitle(_headline(summary), fontsize=11)
    figure.savefig(path, dpi=110)


def _draw_belief(axes: Axes, samples: Sequence[Sample], t: np.ndarray[Any, Any]) -> None:
    """Draw the load of a finger, its friction limit with one sigma, and the probability that the object slides."""
    load, limit, std, slips = (
        np.array(numbers)
        for numbers in zip(*((s.load_n, s.limit_n, s.limit_std_n, s.slip_probability) for s in samples), strict=True)
    )
    lifted = np.isfinite(limit)
    axes.fill_between(t, np.maximum(limit - std, 0), limit + std, color="tab:green", alpha=0.25, lw=0)
    axes.plot(t, limit, color="tab:green", label="friction limit ± 1 sigma")
    axes.plot(t[lifted], load[lifted], color="tab:purple", label="load")
    axes.set_ylim(0, 1.25 * max(float(np.max(load[lifted], initial=0.1)), float(np.median(limit[lifted]))))
    axes.set_ylabel("load of a finger (N)")
    probability = axes.twinx()
    probability.plot(t, slips, color="tab:red", lw=0.9, label="P(slip)")
    probability.set_ylim(0, 1.05)
    probability.set_ylabel("P(slip)")
    lines = [*axes.get_lines(), *probability.get_lines()]
    labels = [str(line.get_label()) for line in lines]
    axes.legend(lines, labels, loc="center right", bbox_to_anchor=(1.0, 0.32), fontsize=8)


def _headline(summary: dict[str, Any]) -> str:
    distance, arrest = summary["slip_distance_m"], summary["time_to_arrest_s"]
    parts = [f"{summary['outcome']} ({summary['figures_are']})"]
    if distance is not None:
        parts.append(f"slipped {1e3 * distance:.1f} mm")
    if arrest is not None:
        parts.append(f"arrested in {1e3 * arrest:.0f} ms")
    return ", ".join(parts)


def _draw_other_finger(axes: Axes, cycle: Cycle) -> None:
    """Draw what a second finger showed at the time of a cycle; nothing for a rig of one."""
    own = cycle.fingers[0].finger
    other = next((finger for finger in cycle.grip.fingers if finger.finger != own), None)
    if other is None:
        axes.set_axis_off()
        return
    draw_frame(axes, other.frame, other.observation.field.reference, other.tracks, f"{other.finger}, at that time")


def _window(samples: Sequence[Sample], t: np.ndarray[Any, Any]) -> tuple[float, float]:
    """Return the part of the time axis that is drawn: from a little before the grip is corrected."""
    acting = [at for at, sample in zip(t, samples, strict=True) if sample.acting]
    if not acting:
        return float(t[0]), float(t[-1])
    span = (float(t[-1]) - float(acting[0])) / (1 - LEAD)
    return max(float(t[0]), float(t[-1]) - span), float(t[-1])


def _shade_stages(
    axes: Axes, samples: Sequence[Sample], t: np.ndarray[Any, Any], window: tuple[float, float], *, named: bool
) -> None:
    """Shade the stages of the job within a part of the time axis, and write their names above it."""
    begin = 0
    ends: list[float] = []
    letter = LETTER * (window[1] - window[0])
    for i in range(1, len(samples) + 1):
        if i == len(samples) or samples[i].stage != samples[begin].stage:
            stage, first, last = samples[begin].stage, float(t[begin]), float(t[min(i, len(t) - 1)])
            begin = i
            if last <= window[0]:
                continue
            axes.axvspan(first, last, color=_STAGE_SHADE.get(stage, "white"), lw=0, zorder=0)
            if not named or last - window[0] < letter:
                continue
            # A name stands in the lowest row in which the name before it has ended.
            at = max(first, window[0])
            row = next((row for row, end in enumerate(ends) if end <= at), len(ends))
            ends[row : row + 1] = [at + letter * (len(stage) + 2)]
            place = axes.get_xaxis_transform()
            axes.text(at, 1.0 + 0.06 * row, f" {stage}", transform=place, fontsize=7, va="bottom")


def _zoom_on_grip(axes: Axes, samples: Sequence[Sample]) -> None:
    """Show the corrections of a few millimetres, not the closing from fully open."""
    acting = [c for c in samples if c.stage in ("settle", "take up", "lift", "hold")]
    values = [1e3 * v for c in acting for v in (c.measured_m, c.held_m) if math.isfinite(v)]
    if values:
        margin = max(1.0, 0.15 * (max(values) - min(values)))
        axes.set_ylim(min(values) - margin, max(values) + margin)


def _top(values: Sequence[float]) -> float:
    finite = [v for v in values if math.isfinite(v)]
    return max(1.0, 1.25 * max(finite, default=1.0))
