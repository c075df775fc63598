"""The tables of a report as (name, value) rows of plain text."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from lsds.support.human import duration, force, length, speed

if TYPE_CHECKING:
    from lsds.session.recording.report.gather import Happening, RunData

Rows = list[tuple[str, str]]

MOST_CORRECTIONS = 1000
"""Most corrections in the list of events; the plot of the aperture shows all."""

_FIGURES = (
    ("slip distance", "slip_distance_m", length),
    ("slip distance seen by the camera", "seen_slip_distance_m", length),
    ("time to arrest", "time_to_arrest_s", duration),
    ("peak slip speed", "peak_slip_speed_m_s", speed),
    ("peak normal force of a finger", "peak_normal_force_n", force),
    ("steady normal force of a finger", "steady_normal_force_n", force),
    ("normal force needed to hold", "required_normal_force_n", force),
    ("error of slip speed (MAE)", "severity_mae_m_s", speed),
    ("error of slip speed while it slips", "severity_moving_mae_m_s", speed),
)
"""Label, key of the summary, and the function that writes the value with its unit."""
_COUNTS = (
    ("frames", "cycles"),
    ("corrections", "corrections"),
    ("unusable frames", "unusable_frames"),
    ("missed cycles", "overruns"),
)


def outcome_of(data: RunData) -> tuple[str, list[str]]:
    """Return the outcome with whether it is simulated, and the reasons for it."""
    kind = "simulated" if data.simulated else "measured"
    summary = data.summary
    if summary is None:
        return f"outcome not recorded ({kind})", [
            "The recording has no summary: the run was killed, the file is damaged or a part of another, or an older "
            "version of lsds wrote it. Plots and events show what the file holds."
        ]
    reasons = [str(summary[key]) for key in ("fault", "outcome_reason", "stop_report") if summary.get(key)]
    missing = [f"not measured: {name} ({why})" for name, why in (summary.get("missing") or {}).items()]
    return f"{summary['outcome']} ({summary['figures_are']})", reasons + missing


def result_rows(data: RunData) -> Rows:
    """Return the figures of the run; each simulated one states that it is."""
    mark = " (simulated)" if data.simulated else ""
    rows: Rows = [("length of the recording", f"{data.end_s - data.begin_s:.2f} s")]
    summary = data.summary
    if summary is None:
        return [*rows, ("frames", str(data.cycles))]
    for label, key, written in _FIGURES:
        if (value := summary.get(key)) is not None:
            rows.append((label, f"{written(value)}{mark}"))
    rows += [(label, str(summary[key])) for label, key in _COUNTS if summary.get(key) is not None]
    return rows


def simulation_rows(data: RunData) -> Rows:
    """Return what was simulated, and how."""
    if not data.simulated:
        return [("simulated", "nothing that lsds knows of: no simulated cell (a device on a network may be a mock)")]
    images = "the images of the sensors come from it" if data.header.simulated else "the images do not come from it"
    rows: Rows = [("simulated", f"the cell '{data.cell}' with the devices in it; {images}")]
    report = (data.summary or {}).get("simulation")
    if report:
        rows.append(("gel", str(report["summary"])))
        rows += [("warning", str(warning)) for warning in report["warnings"]]
    return rows


def timing_rows(data: RunData) -> Rows:
    """Return the costs of the run on the computer that ran it."""
    summary = data.summary
    if summary is None:
        return [("timings", "not recorded")]
    timing = summary["timing"]
    rows: Rows = [("wall time", f"{timing['wall_s']:.2f} s")]
    if summary.get("realtime_factor"):
        rows.append(("speed", f"{summary['realtime_factor']:.3g} x real time"))
    for label, cost in (("image to command", summary["frame_to_command_us"]), ("imprint", timing["imprint_us"])):
        if cost["p50"] is not None:
            rows.append((label, f"median {_us(cost['p50'])}, p99 {_us(cost['p99'])}"))
    rows += [(f"task {name}", _task(own)) for name, own in timing["tasks"].items()]
    return rows


def _task(own: dict[str, Any]) -> str:
    return (
        f"{own['runs']} runs, mean {_us(own['mean_us'])}, p99 {_us(own['p99_us'])}, max {_us(own['max_us'])}, "
        f"{own['overruns']} overruns"
    )


def _us(value_us: float) -> str:
    return duration(1e-6 * value_us)


def version_rows(data: RunData, plotly_js: str) -> Rows:
    """Return where the recording comes from, and what made it and this page."""
    header = data.header
    started = datetime.fromtimestamp(header.started_utc_s, UTC).isoformat(sep=" ", timespec="seconds")
    rows: Rows = [("recording", f"{data.path.name}, format {header.format}"), ("began", started)]
    rows += [(name, version) for name, version in sorted({**header.versions, "lsds": header.lsds}.items())]
    rows += [(f"images of {name}", images.thinning) for name, images in data.images.items()]
    return [*rows, ("plotly.js of this page", plotly_js)]


def backend_rows(data: RunData) -> Rows:
    """Return the plugin of each kind, and the seed."""
    summary = data.summary or {}
    rows: Rows = [(kind, str(name)) for kind, name in (summary.get("backends") or {}).items()]
    return rows if summary.get("seed") is None else [*rows, ("seed", str(summary["seed"]))]


def listed(data: RunData) -> tuple[list[Happening], str]:
    """Return the events of the list, and a note if it leaves out corrections."""
    corrections = [each for each in data.happenings if each.kind == "correction"]
    left_out = corrections[MOST_CORRECTIONS:]
    if not left_out:
        return data.happenings, ""
    last_s = corrections[MOST_CORRECTIONS - 1].t_s
    kept = [each for each in data.happenings if each.kind != "correction" or each.t_s <= last_s]
    return kept, f"{len(left_out)} later corrections are not listed; the plot of the aperture shows them."
