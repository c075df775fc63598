"""Store what commands print, so that a test can compare the documents with it: `python docs/measure.py NAME`.

A measurement is a list of runs and the rows that a page quotes of them. `docs/measured/NAME.json` holds the command,
the commit on which it was run, and the values. Rows are printed for pasting; `tests/docs/test_figures.py` looks for
each of them in its page. Measurements on recordings find them through `LSDS_DATA`.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
MEASURED = DOCS / "measured"


@dataclass(frozen=True)
class Measurement:
    """`run` returns values for JSON, `rows` the lines that `page` quotes of them."""

    command: str
    page: str
    run: Callable[[], Any]
    rows: Callable[[Any], list[str]]


# -- the pipe -------------------------------------------------------------------------------------------------

PAPER = ("controller.backend=pd", "task.grip_aperture_m=0.0236")
VARIANTS: Mapping[str, tuple[str, ...]] = {
    "default": (),
    "pd": PAPER,
    "half gain": (*PAPER, "controller.pd.kp=1.5", "controller.pd.kd=0.2"),
    "dots alone": (*PAPER, "detector.backend=field-mlp", "estimator.backend=field-gru"),
    "untrained": (*PAPER, "detector.backend=rigid-residual", "estimator.backend=field"),
}
FIGURES = (
    ("slip_distance_m", 1e3, 1),
    ("time_to_arrest_s", 1e3, 0),
    ("peak_normal_force_n", 1, 1),
    ("steady_normal_force_n", 1, 1),
    ("severity_moving_mae_m_s", 1e2, 2),
    ("severity_mae_m_s", 1e2, 2),
    ("severity_zero_predictor_mae_m_s", 1e2, 2),
)
LABELS = (
    "slip distance, mm",
    "time to arrest, from the true onset, ms",
    "peak normal force per finger, N (2.8 N needed)",
    "steady normal force, N",
    "error of the slip speed while it slips (MAE), cm/s",
    "error over all frames of lift and hold, cm/s",
    "the same for an estimate of always zero",
)


def pipe() -> dict[str, Any]:
    """Return each figure of twenty seeds for each variant."""
    import lsds

    found: dict[str, Any] = {}
    for name, overrides in VARIANTS.items():
        summaries = [lsds.run(overrides=[*overrides, f"seed={seed}"]).summary for seed in range(20)]
        found[name] = {key: [summary[key] for summary in summaries] for key, _, _ in FIGURES}
        found[name]["held"] = sum(summary["outcome"] == "held" for summary in summaries)
    return found


def pipe_rows(values: dict[str, Any]) -> list[str]:
    """Return one row a figure: medians, with the ranges in parentheses."""

    def cell(numbers: list[float | None], scale: float, digits: int) -> str:
        known = [scale * number for number in numbers if number is not None]
        middle, low, high = statistics.median(known), min(known), max(known)
        return f"{middle:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"

    rows = [
        " | ".join([f"| {label}", *(cell(own[key], scale, digits) for own in values.values())]) + " |"
        for label, (key, scale, digits) in zip(LABELS, FIGURES, strict=True)
    ]
    return ["| held, of 20 | " + " | ".join(str(own["held"]) for own in values.values()) + " |", *rows]


# -- slip on real recordings ----------------------------------------------------------------------------------

BOTH = "both"
DETECTORS = {
    "fused": "`fused`, the default: imprint and dots, real and simulated frames",
    "fused, calibrated": "`fused`, calibrated (`lsds calibrate slip` on the other scored objects of the setup)",
    "fused, without the object": "`fused`, fitted without the object, real frames only",
    "fused, from the other setup": "`fused`, real frames of the other setup only",
    "imprint": "`imprint`, untrained",
    "imprint, calibrated": "`imprint`, calibrated in the same way",
    "monotone": "`monotone`, simulated frames: dots alone",
    "field-mlp": "`field-mlp`, simulated frames: dots alone",
}
OF_EACH_SETUP = ("fused", "fused, calibrated", "imprint")


def slip() -> dict[str, Any]:
    """Return the rows of `lsds evaluate slip` on the public incipient-slip set."""
    folder = Path(os.environ["LSDS_DATA"]) / "incipient_slip"
    found = result_of("evaluate", "slip", str(folder))
    return {"rows": [row for row in found["rows"] if row["detector"] in DETECTORS], "title": found["title"]}


def slip_rows(values: dict[str, Any]) -> list[str]:
    """Return one row a detector, and one for each setup of some."""

    def row(label: str, own: Mapping[str, Any]) -> str:
        share = f"{own['at_noticed']:.2f} [{own['at_low']:.2f}, {own['at_high']:.2f}]"
        counts = f"{own['found']:.2f} | {own['noticed']:.2f} | {own['per_100_moving']:.1f} | {own['per_100_still']:.2f}"
        return f"| {label} | {counts} | {share} |"

    rows = []
    for name, label in DETECTORS.items():
        own = {each["setup"]: each for each in values["rows"] if each["detector"] == name}
        rows.append(row(label, own[BOTH]))
        if name in OF_EACH_SETUP:
            rows += [row(f"{name}: {setup}", each) for setup, each in own.items() if setup != BOTH]
    return rows


MEASUREMENTS: dict[str, Measurement] = {
    "slip": Measurement("lsds evaluate slip $LSDS_DATA/incipient_slip", "learning.md", slip, slip_rows),
    "pipe": Measurement("python docs/measure.py pipe", "figures.md", pipe, pipe_rows),
}


def stored(name: str) -> dict[str, Any]:
    """Return a stored measurement."""
    found: dict[str, Any] = json.loads((MEASURED / f"{name}.json").read_text(encoding="utf-8"))
    return found


def result_of(*command: str) -> Any:
    """Return the JSON that a command of lsds writes."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "result.json"
        subprocess.run([sys.executable, "-P", "-m", "lsds.cli.main", *command, "--json", str(file)], check=True)
        return json.loads(file.read_text(encoding="utf-8"))


def _commit() -> str:
    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=DOCS, capture_output=True, text=True, check=True).stdout.strip()

    changed = " with changes" if git("status", "--porcelain", "--untracked-files=no") else ""
    return git("rev-parse", "--short", "HEAD") + changed


def main(names: list[str]) -> None:
    """Measure, store and print."""
    MEASURED.mkdir(exist_ok=True)
    for name in names:
        measurement = MEASUREMENTS[name]
        values = measurement.run()
        record = {
            "command": measurement.command,
            "commit": _commit(),
            "date": datetime.now(UTC).date().isoformat(),
            "values": values,
        }
        (MEASURED / f"{name}.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
        print("\n".join(measurement.rows(values)))


if __name__ == "__main__":
    main(sys.argv[1:])
