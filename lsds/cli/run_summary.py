"""The summary of a run as a table: a short one, and one with every figure for `--verbose`."""

from __future__ import annotations

from typing import Any

from lsds.cli.text_table import table
from lsds.support.human import MISSING, duration, force, length, number, speed

Rows = list[tuple[str, str]]


def short_table(summary: dict[str, Any]) -> str:
    """Return the verdict with its reason, and the slip and the grip that it is about.

    Without a figure of the computer's own speed: a simulated run with the same seed prints the same text.
    """
    rows = [
        *_verdict(summary),
        *_caveats(summary["simulation"]),
        ("slip", _slip(summary)),
        *_seen(summary),
        ("grip of a finger", _grip(summary)),
        *_called(summary, with_truth=False),
        ("corrections", f"{summary['corrections']} in {summary['cycles']} frames"),
        *_guarded(summary["guard"]),
        *([("missed cycles", str(summary["overruns"]))] if summary["overruns"] else []),
    ]
    return table(rows, ("figure", "value"))


def full_table(summary: dict[str, Any]) -> str:
    """Return every figure of the summary that is a number of the run."""
    rows = [
        *_verdict(summary),
        *_simulation(summary["simulation"]),
        ("slip distance", length(summary["slip_distance_m"])),
        *_seen(summary),
        ("time to arrest", duration(summary["time_to_arrest_s"])),
        ("peak slip speed", speed(summary["peak_slip_speed_m_s"])),
        ("peak normal force", f"{force(summary['peak_normal_force_n'])} a finger"),
        ("steady normal force", f"{force(summary['steady_normal_force_n'])} a finger"),
        ("needed to hold", f"{force(summary['required_normal_force_n'])} a finger"),
        ("error of slip speed (MAE)", speed(summary["severity_mae_m_s"])),
        ("  zero at all times would have", speed(summary["severity_zero_predictor_mae_m_s"])),
        ("  while it slips", speed(summary["severity_moving_mae_m_s"])),
        ("  zero would have meanwhile", speed(summary["severity_moving_zero_predictor_mae_m_s"])),
        *_called(summary, with_truth=True),
        ("frames, corrections", f"{summary['cycles']}, {summary['corrections']}"),
        *_guarded(summary["guard"]),
        ("unusable frames", str(summary["unusable_frames"])),
        *([("left out by the budget", f"{skipped} frames")] if (skipped := summary["skipped_frames"]) else []),
        ("missed cycles", str(summary["overruns"])),
        ("image to command", _cost(summary["frame_to_command_us"])),
        *_imprint(summary["timing"]["imprint_us"]),
        ("speed", _times(summary["realtime_factor"])),
        ("seed", str(summary["seed"])),
    ]
    return table(rows, ("figure", "value"))


def _verdict(summary: dict[str, Any]) -> Rows:
    missing = "".join(f"; not measured: {name} ({why})" for name, why in summary["missing"].items())
    return [
        ("outcome", f"{summary['verdict']['outcome']} ({summary['figures_are']}){missing}"),
        ("reason", summary["verdict"]["reason"]),
        *([("afterwards", summary["stop_report"])] if summary["stop_report"] else []),
    ]


def _simulation(report: dict[str, Any] | None) -> Rows:
    """Return rows on how the physics was simulated, with its warnings."""
    if report is None:
        return []
    return [("gel", report["summary"]), *(("  warning", warning) for warning in report["warnings"])]


def _caveats(report: dict[str, Any] | None) -> Rows:
    """Return a row with the number of the simulation's warnings; empty without any."""
    count = 0 if report is None else len(report["warnings"])
    return [("gel model", f"{count} warning{'s' * (count > 1)}, listed with --verbose")] if count else []


def _slip(summary: dict[str, Any]) -> str:
    if summary["slip_distance_m"] is None:
        return "unknown without the simulation's truth"
    text = length(summary["slip_distance_m"])
    if summary["slip_onset_s"] is None:
        return text
    arrest_s = summary["time_to_arrest_s"]
    ended = "never stopped" if arrest_s is None else f"stopped after {duration(arrest_s)}"
    return f"{text}, at most {speed(summary['peak_slip_speed_m_s'])}, {ended}"


def _grip(summary: dict[str, Any]) -> str:
    if summary["peak_normal_force_n"] is None:
        return "unknown without the simulation's truth"
    steady_n = summary["steady_normal_force_n"]
    steady = "" if steady_n is None else f"{force(steady_n)} at the end, "
    peak, needed = force(summary["peak_normal_force_n"]), force(summary["required_normal_force_n"])
    return f"{steady}{peak} peak, {needed} needed at most"


def _called(summary: dict[str, Any], *, with_truth: bool) -> Rows:
    """Return the row of the frames called slip, with the true slip if asked for; empty without frames."""
    frames = summary["called_slip"]
    if frames is None:
        return []
    slipped_m = frames["slipped_m"]
    truth = "" if slipped_m is None or not with_truth else f"; it truly slipped {length(slipped_m)}"
    when = " since the lift" if frames["lifted"] else ""
    return [(f"called slip{when}", f"{frames['slip']} of {frames['answered']} frames{truth}")]


def _guarded(counts: dict[str, int]) -> Rows:
    """Return a row if corrections wanted to open the fingers and the guard refused it."""
    refused = counts["kept_closed"]
    return [("  refused, would open", f"{refused}: the controller does not state that it may open")] if refused else []


def _seen(summary: dict[str, Any]) -> Rows:
    """Return the row of the pose source; empty without one."""
    seen_m = summary["seen_slip_distance_m"]
    return [] if seen_m is None else [("  seen by the camera", length(seen_m))]


def _cost(cost_us: dict[str, float | None]) -> str:
    """Return a computing time, median and 99th percentile, given in us."""
    p50, p99 = (None if value is None else duration(1e-6 * value) for value in (cost_us["p50"], cost_us["p99"]))
    return f"{p50 or MISSING} median, {p99 or MISSING} p99"


def _imprint(cost_us: dict[str, float | None]) -> Rows:
    """Return the row of the imprint's share of the cost; empty if it was not computed."""
    return [] if cost_us["p50"] is None else [("  of it the imprint", _cost(cost_us))]


def _times(factor: float | None) -> str:
    return MISSING if factor is None else f"{number(factor)} x real time"
