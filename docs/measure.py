"""Store what commands print, so that a test can compare the documents with it: `python docs/measure.py NAME`.

A measurement is a list of runs and the rows that a page quotes of them. `docs/measured/NAME.json` holds the command,
the commit on which it was run, and the values. Rows are printed for pasting; `tests/docs/test_figures.py` looks for
each of them in its page. Measurements on recordings, and on datasets of `lsds learn collect`, find their folders below
`LSDS_DATA`.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
MEASURED = DOCS / "measured"


@dataclass(frozen=True)
class Measurement:
    """`run` returns values for JSON, `rows` the lines that `page` quotes; `run` is None if the command was removed."""

    command: str
    page: str
    run: Callable[[], Any] | None
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
    return [
        "| held, with at most 5 times the needed force, of 20 | "
        + " | ".join(str(own["held"]) for own in values.values())
        + " |",
        *rows,
    ]


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
    """Return the rows of `lsds study slip` on the public incipient-slip set."""
    found = result_of("study", "slip", str(_folder("incipient_slip")))
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


# -- models on objects that they were not fitted on -----------------------------------------------------------

UNSEEN = ("book", "scissors", "plank", "sponge", "duster")
CLASSIFIERS = ("field-mlp", "logistic", "fused", "monotone", "gradient-boosting", "random-forest", "one-parameter rule")
SPEEDS = ("field-gru", "imprint-gru", "lstm", "mlp", "linear-window", "always zero", "constant in contact")
Row = Mapping[str, Any]


def _scored(dataset: str, *words: str) -> dict[str, Any]:
    """Return the rows, and how many recordings they are of."""
    found = result_of("study", "models", str(_folder(dataset)), *words)
    return {"of": found["notes"][0].split(";")[0], "rows": found["rows"]}


def _of(rows: list[Row], model: str) -> dict[str, Row]:
    return {row["object"]: row for row in rows if row["model"] == model}


def _code(model: str) -> str:
    return model if " " in model else f"`{model}`"


def detection() -> dict[str, Any]:
    """Return the scores of detectors on five held-out objects, and the accuracy that the paper prints."""
    from lsds_research.reproduce.printed import UNSEEN_ACCURACY

    printed = {name: UNSEEN_ACCURACY["random-forest", name] for name in (*UNSEEN, "all")}
    return {**_scored("detection"), "printed": printed}


def detection_rows(values: dict[str, Any]) -> list[str]:
    """Return one row a detector, and what the paper prints."""

    def row(model: str) -> str:
        own = _of(values["rows"], model)
        every = own["all"]
        cells = [f"{100 * own[name]['accuracy']:.1f}" for name in UNSEEN]
        cells += [
            f"{100 * every['accuracy']:.1f} [{100 * every['accuracy_low']:.1f}, {100 * every['accuracy_high']:.1f}]"
        ]
        cells += [f"{100 * every['accuracy_all']:.1f}", f"{own['sponge']['false_positive_rate']:.3f}"]
        cells += [f"{100 * every['onsets_missed']:.1f} %", f"{every['false_alarms_per_min']:.0f}"]
        return " | ".join([f"| {_code(model)}", *cells, f"{100 * every['answered']:.0f} % |"])

    printed = " | ".join(f"*{values['printed'][name]:.1f}*" for name in (*UNSEEN, "all"))
    return [*(row(model) for model in CLASSIFIERS), f"| *printed, random forest* | {printed} | | | | | |"]


def severity() -> dict[str, Any]:
    """Return the scores of estimators over all objects of a dataset, for three datasets."""
    asked = {"severity": (), "detection": ("--job", "estimate"), "pipe": ()}
    found = {name: _scored(name, *words) for name, words in asked.items()}
    return {
        name: {"of": own["of"], "rows": [_of(own["rows"], model)["all"] for model in SPEEDS]}
        for name, own in found.items()
    }


def severity_rows(values: dict[str, Any]) -> list[str]:
    """Return one row an estimator."""

    def three(own: Row) -> str:
        return f"{own['mae_cm_s']:.2f}, {own['moving_mae_cm_s']:.2f}, {own['r2']:.2f}"

    def covered(own: Row, first: str, second: str) -> str:
        return f"{100 * own[first]:.0f} % ({100 * own[second]:.0f})" if own[first] is not None else ""

    rows = []
    datasets = (values[name]["rows"] for name in ("severity", "detection", "pipe"))
    for still, held, pipe_ in zip(*datasets, strict=True):
        cells = [_code(still["model"]), three(still), covered(still, "coverage", "moving_coverage")]
        cells += [three(held), three(pipe_), _percent(still["angular_relative_error"])]
        cells += [covered(still, "angular_coverage", "turning_coverage"), _percent(still["answered"])]
        rows.append(f"| {' | '.join(cells)} |")
    return rows


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100 * share:.0f} %"


# -- every frame of simulated trials (the study was removed; its record stays) --------------------------------

ASKED = {
    "--detector": ("fused", "imprint", "field-mlp", "monotone"),
    "--estimator": ("fused", "imprint", "imprint-gru", "field-gru"),
}
ASK = ("study", "asked", *(word for flag, names in ASKED.items() for name in names for word in (flag, name)))


def asked_rows(values: dict[str, Any]) -> list[str]:
    """Return one row a detector, then one row an estimator."""
    detectors = [
        f"| `{row['detector']}` | {row['found']:.2f} | {row['per_100_sliding']:.1f} | {row['per_100_loads']:.1f} |"
        for row in values["detectors"]
        if row["object"] == "all"
    ]
    estimators = [
        f"| `{row['estimator']}` | {row['mae_cm_s']:.2f} | {row['moving_mae_cm_s']:.2f} | {row['load_mae_cm_s']:.2f} | "
        f"{row['angular_error']:.0f} % | {row['coverage']:.2f}, {row['moving_coverage']:.2f} |"
        for row in values["rows"]
        if row["object"] == "all"
    ]
    return detectors + estimators


# -- whole real recordings ------------------------------------------------------------------------------------

WHOLE = {
    "whole recording": "clip model, both cameras",
    "across setups, whole recording: whole": "clip model of the zoomed pad, on the whole pad",
    "across setups, whole recording: zoomed": "clip model of the whole pad, on the zoomed pad",
    "online: running mean": "online, running mean of windows, at the end",
    "online: one window": "online, one window",
    "one number: mean speed": "threshold on the mean speed while moving",
    "one number: two-frame": "threshold on the two-frame maximum of v_net",
    "length alone": "length of the recording, which no model gets",
    "file alone": "number of frames, bytes and place in the set, which no model gets",
    "first frame": "first frame alone",
    "last frame": "last frame alone",
    "nuisances": "nuisance controls",
    "labels shuffled": "shuffled labels",
    "majority": "majority",
}
AS_IT_IS = ("monotone", "field-mlp", "logistic", "random-forest", "gradient-boosting")


def incipient() -> dict[str, Any]:
    """Return the rows of `lsds study incipient-slip` on the public set."""
    found = result_of("study", "incipient-slip", str(_folder("incipient_slip")), "--cache", "none")
    return {key: found[key] for key in ("title", "notes", "rows", "online", "clip_frames", "folds", "prevalence")}


def incipient_rows(values: dict[str, Any]) -> list[str]:
    """Return one row a model or control: the first that the command prints under a name."""

    def row(begins: str, label: str) -> str:
        own = next(each for each in values["rows"] if f"{each['model']}: {each['tested']}".startswith(begins))
        return " | ".join([f"| {label}", *(interval(own, name) for name in ("auc", "accuracy"))]) + " |"

    def interval(own: Row, name: str) -> str:
        return f"{own[name]:.3f} [{own[f'{name}_low']:.3f}, {own[f'{name}_high']:.3f}]"

    simulated = [row(f"{name}, trained on simulated", f"`{name}`, simulated frames, as it is") for name in AS_IT_IS]
    return [*(row(begins, label) for begins, label in WHOLE.items()), *simulated]


# -- random objects -------------------------------------------------------------------------------------------

RANDOM = ("study", "grip", "--random", "300", "--draw", "1018", "--controller", "belief")


def random_objects() -> list[dict[str, Any]]:
    """Return a row a controller."""
    rows: list[dict[str, Any]] = result_of(*RANDOM, "--no-plot")["rows"]
    return rows


def random_rows(values: list[dict[str, Any]]) -> list[str]:
    """Return one row a controller; what slipped as median and 95 % quantile."""
    return [
        f"| `{row['controller']}` | {round(row['held'] * row['runs'])} of {row['runs']} | {row['met']} | "
        f"{row['slip_mm']:.1f}, {row['slip_95_mm']:.1f} | {row['peak']:.2f}, {row['peak_95']:.2f} | "
        f"{row['steady']:.2f}, {row['steady_95']:.2f} | {100 * (row['grew'] or 0):.0f} % |"
        for row in values
    ]


# -- the frame path -------------------------------------------------------------------------------------------

TRACKERS = {
    "lk": "`lk`",
    "centroid": "`centroid`",
    "dis": "`dis` (for gels without markers)",
    "blobs, nearest": "peer: OpenCV blobs, nearest match",
    "pyramidal LK": "peer: pyramidal Lucas-Kanade, frame to frame",
}
PARTS = ("image to command", "perception", "imprint", "detector", "estimator", "grip belief", "controller")


def frame() -> dict[str, Any]:
    """Return trackers and times of the parts."""
    found = result_of("study", "frame", "--repeats", "12", "--no-plot")
    return {key: found[key] for key in ("trackers", "total", "portable", "parts", "peers", "frames")}


def frame_rows(values: dict[str, Any]) -> list[str]:
    """Return one row a tracker, and one a part of the frame path."""
    trackers = {row["name"]: row for row in values["trackers"]}
    rows = [
        f"| {label} | {row['p50_us']:.0f} | {row['rms_px']:.3f} | {100 * row['jump_wrong_unflagged']:.0f} % | "
        f"{100 * row['jump_right']:.0f} % |"
        for label, row in ((label, trackers[name]) for name, label in TRACKERS.items())
    ]
    parts = {row["name"]: row for row in (values["total"], values["portable"], *values["parts"])}
    names = (PARTS[0], values["portable"]["name"], *PARTS[1:])
    rows += [f"| {name} | {parts[name]['p50_us']:.0f} | {parts[name]['p99_us']:.0f} |" for name in names]
    peers = [f"| peer: {row['name']} | {row['p50_us']:.0f} | {row['p99_us']:.0f} |" for row in values["peers"]]
    return rows + peers


# -- whole configurations -------------------------------------------------------------------------------------


def loop() -> dict[str, Any]:
    """Return time, slip and grip of each configuration."""
    return {"configurations": result_of("study", "loop", "--quick", "--no-plot")["configurations"]}


def loop_rows(values: dict[str, Any]) -> list[str]:
    """Return one row a configuration, the quickest first."""
    return [
        f"| `{row['detector']}` + `{row['estimator']}`, `{row['controller']}` | {row['frame_us']:.0f} | "
        f"{100 * row['held']:.0f} % | {row['slip_mm']:.2f} | {row['steady_all']:.2f} | "
        f"{'yes' if row['front'] else ''} |"
        for row in sorted(values["configurations"], key=lambda row: row["frame_us"])
    ]


# -- the mocks on the wire ------------------------------------------------------------------------------------


def arm() -> dict[str, Any]:
    """Return what the arm mock's benchmark measures."""
    values: dict[str, Any] = benchmark("tests.wire.ur.bench", "--seconds", "60")
    return values


def arm_rows(values: dict[str, Any]) -> list[str]:
    """Return the rows of the arm's table."""
    stream, commands = values["stream"], values["commands"]
    gap, blocking, moving = stream["gap_ms"], commands["blocking_ms"], commands["speed_to_motion_ms"]
    exact = "all exactly" if stream["steps_exact"] else "not all"
    shares = f"{100 * stream['core_share']:.1f} % / {100 * commands['core_share_with_program']:.1f} %"
    return [
        f"| rate, lost packages, steps of the time stamp | {stream['rate_hz']:.3f} Hz, {stream['lost']} in 60 s, "
        f"{exact} 0.002 s |",
        f"| gap between packages, p50 / p99 / p99.9 / max | {gap['p50']:.2f} / {gap['p99']:.2f} / {gap['p99.9']:.1f} / "
        f"{gap['max']:.1f} ms (p99 at most 2.3) |",
        f"| blocking command, p50 / p95 / max | {blocking['p50']:.1f} / {blocking['p95']:.1f} / {blocking['max']:.1f} "
        "ms (p95 at most 6) |",
        f"| speed command to measured motion, p50 / p95 / max | {moving['p50']:.1f} / {moving['p95']:.1f} / "
        f"{moving['max']:.1f} ms (at most 6) |",
        f"| share of a core, streaming / with ur_rtde's program | {shares} (at most 15 %) |",
    ]


def cameras() -> dict[str, Any]:
    """Return what the cameras' benchmark measures."""
    values: dict[str, Any] = benchmark("tests.wire.cameras.bench")
    return values


def camera_rows(values: dict[str, Any]) -> list[str]:
    """Return one row a size."""
    return [
        f"| {size.replace('x', ' x ')} | {row['fps']:.1f} | {row['p50_ms']:.1f} / {row['p95_ms']:.1f} / "
        f"{row['max_ms']:.0f} ms |"
        for size, row in values["opencv"].items()
    ]


# -- other costs ----------------------------------------------------------------------------------------------


def cost() -> dict[str, Any]:
    """Return times of imports, of the help, of the scheduler, and the speed of the simulated cell."""
    import lsds

    def process_s(*words: str) -> float:
        times = []
        for _ in range(5):
            began = time.perf_counter()
            subprocess.run([sys.executable, "-P", *words], check=True, capture_output=True)
            times.append(time.perf_counter() - began)
        return statistics.median(times)

    empty_s = process_s("-c", "pass")
    found: dict[str, Any] = {"import_s": process_s("-c", "import lsds") - empty_s}
    found["help_s"] = process_s("-m", "lsds.cli.main", "--help")
    found["scheduler"] = {row["name"]: row["median_ms"] for row in result_of("study", "scheduler")["rows"]}
    for name, overrides in {
        "auto": [],
        "pad": ["cell.simulated.fidelity=pad", "cell.simulated.grid=1"],
        "winkler": ["cell.simulated.fidelity=winkler"],
    }.items():
        speeds = []
        for seed in range(3):
            began = time.perf_counter()
            truths = lsds.run(overrides=[*overrides, f"seed={seed}"]).truths
            speeds.append((truths[-1].t_ns - truths[0].t_ns) * 1e-9 / (time.perf_counter() - began))
        found[name] = statistics.median(speeds)
    return found


def cost_rows(values: dict[str, Any]) -> list[str]:
    """Return one row a figure."""
    scheduler = values["scheduler"]
    return [
        f"| speed of the simulated cell, `auto` (loop included) | {values['auto']:.1f} times real time |",
        f"| the same, `fidelity=pad`, `grid=1` | {values['pad']:.1f} |",
        f"| the same, `fidelity=winkler` | {values['winkler']:.1f} |",
        f"| scheduler, 60 s of four rates (`lsds study scheduler`) | {scheduler['lsds']:.0f} ms; Python's `sched`, "
        f"without statistics, {scheduler['sched']:.0f} ms |",
        f"| `import lsds`, beyond an empty Python | {1e3 * values['import_s']:.0f} ms |",
        f"| `lsds --help`, whole process | {values['help_s']:.2f} s |",
    ]


# -- public clients against the wire mocks ----------------------------------------------------------------------

CLIENTS = (
    ("gripper", "pymodbus_hand_e:Client", "pymodbus"),
    ("gripper", "minimalmodbus_hand_e:Client", "minimalmodbus"),
    ("gripper", "pyrobotiqgripper_hand_e:Client", "pyRobotiqGripper"),
    ("arm", "ur_rtde_arm:Client", "ur_rtde"),
    ("sensor", "opencv_camera:Client", "OpenCV"),
    ("gripper", "lsds_drivers:HandE", "lsds `hand-e`"),
    ("arm", "lsds_drivers:Ur5e", "lsds `ur5e`"),
    ("sensor", "lsds_drivers:Fingertip", "lsds `gelsight-mini`"),
)
FINDINGS = ("hang", "crash", "blocked", "opened", "ran on", "wrong value", "did not follow")


def clients() -> dict[str, Any]:
    """Return the findings of each client under every fault and severity, and its runs on a healthy line."""
    found = {}
    for kind, name, label in CLIENTS:
        outcomes = _tried(kind, name, "all", 1)["outcomes"]
        healthy = _tried(kind, name, "none", HEALTHY)
        found[label] = {
            "version": _version(label),
            "cases": len(outcomes),
            "not_begun": sum(bool(one["broken"]) for one in outcomes),
            "never_right_again": sum(one["recovery_s"] is None and not one["broken"] for one in outcomes),
            "findings": [
                [_title(one["case"]), finding["kind"], finding["text"]]
                for one in outcomes
                for finding in one["findings"]
            ],
            "healthy": len(healthy["outcomes"]),
            "healthy_findings": sum(healthy["counts"].values()),
        }
    return found


HEALTHY = 40
"""Runs of each client on a healthy line: 200 of the five public ones."""
_PACKAGES = {"pyRobotiqGripper": "pyrobotiqgripper", "OpenCV": "opencv-python-headless"}


def _version(label: str) -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(_PACKAGES.get(label, label))
    except PackageNotFoundError:
        return ""


def _title(case: dict[str, Any]) -> str:
    return case["fault"] if case["severity"] is None else f"{case['fault']} {case['severity']}"


def _tried(kind: str, name: str, faults: str, repeats: int) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "outcomes.json"
        words = ["check", kind, "--client", f"examples.clients.{name}", "--faults", faults, "--repeats", str(repeats)]
        command = [sys.executable, "-P", "-m", "lsds.cli.main", *words, "--json", str(file)]
        done = subprocess.run(command, cwd=DOCS.parent, check=False)
        if done.returncode not in (0, 1) or not file.exists():
            raise SystemExit(f"{name}: lsds check ended with {done.returncode}")
        return json.loads(file.read_text(encoding="utf-8"))


def client_rows(values: dict[str, Any]) -> list[str]:
    """Return one row a client: cases with each finding."""
    rows = []
    for label, own in values.items():
        kinds = [len({case for case, kind, _ in own["findings"] if kind == wanted}) for wanted in FINDINGS]
        counts = " | ".join(str(count) if count else "-" for count in kinds)
        name = f"{label} {own['version']}".strip()
        healthy = f"{own['healthy_findings']} of {own['healthy']}"
        rows.append(f"| {name} | {own['cases']} | {counts} | {own['never_right_again']} | {healthy} |")
    return rows


MEASUREMENTS: dict[str, Measurement] = {
    "arm": Measurement("python -m tests.wire.ur.bench --seconds 60", "figures.md", arm, arm_rows),
    "cameras": Measurement("python -m tests.wire.cameras.bench", "figures.md", cameras, camera_rows),
    "clients": Measurement("python docs/measure.py clients", "clients.md", clients, client_rows),
    "cost": Measurement("python docs/measure.py cost", "speed.md", cost, cost_rows),
    "random": Measurement("lsds " + " ".join(RANDOM), "grip_figures.md", random_objects, random_rows),
    "frame": Measurement("lsds study frame --repeats 12", "speed.md", frame, frame_rows),
    "loop": Measurement("lsds study loop --quick", "speed.md", loop, loop_rows),
    "slip": Measurement("lsds study slip $LSDS_DATA/incipient_slip", "learning.md", slip, slip_rows),
    "detection": Measurement("lsds study models $LSDS_DATA/detection", "learning.md", detection, detection_rows),
    "severity": Measurement("python docs/measure.py severity", "learning.md", severity, severity_rows),
    "asked": Measurement("lsds " + " ".join(ASK), "learning.md", None, asked_rows),
    "incipient": Measurement(
        "lsds study incipient-slip $LSDS_DATA/incipient_slip --cache none", "learning.md", incipient, incipient_rows
    ),
    "pipe": Measurement("python docs/measure.py pipe", "figures.md", pipe, pipe_rows),
}


def stored(name: str) -> dict[str, Any]:
    """Return a stored measurement."""
    found: dict[str, Any] = json.loads((MEASURED / f"{name}.json").read_text(encoding="utf-8"))
    return found


def result_of(*command: str) -> Any:
    """Return the JSON that a command of lsds writes."""
    return _written("-P", "-m", "lsds.cli.main", *command)


def _folder(dataset: str) -> Path:
    return Path(os.environ["LSDS_DATA"]) / dataset


def benchmark(module: str, *arguments: str) -> Any:
    """Return the JSON that a benchmark of the test suite writes."""
    return _written("-m", module, *arguments)


def _written(*words: str) -> Any:
    """Return the JSON that Python writes with `--json`, run from the repository's root."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "result.json"
        subprocess.run([sys.executable, *words, "--json", str(file)], check=True, cwd=DOCS.parent)
        return json.loads(file.read_text(encoding="utf-8"))


def _commit() -> str:
    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=DOCS, capture_output=True, text=True, check=True).stdout.strip()

    # Nothing in docs/ changes what a command prints, and the command is stored as well.
    besides = (":/", ":(top,exclude)docs")
    changed = " with changes" if git("status", "--porcelain", "--untracked-files=no", "--", *besides) else ""
    return git("rev-parse", "--short", "HEAD") + changed


def main(names: list[str]) -> None:
    """Measure, store and print."""
    MEASURED.mkdir(exist_ok=True)
    for name in names:
        measurement = MEASUREMENTS[name]
        if measurement.run is None:
            raise SystemExit(f"{name}: the command that measured this was removed; keep the stored record")
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
