"""The tables in Markdown: measured figures, printed figures, trivial baselines and controls."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from lsds_research.collecting.objects import UNSEEN
from lsds_research.reproduce import printed
from lsds_research.reproduce.jobs import FEW_GROUPS, GROUPS, OWN_ESTIMATORS, SHUFFLED_MOST, most

Row = dict[str, Any]


def markdown(result: dict[str, Any]) -> str:
    """Return the whole report."""
    rows: list[Row] = result["rows"]
    sets = result["datasets"]
    frames = ", ".join(f"{job} {card['rows']} frames of {card['recordings']} recordings" for job, card in sets.items())
    parts = [
        "# The study's tables, measured here",
        "All figures below are **simulated**, except those in columns called *printed*: they are the paper's, from real"
        " recordings that are not public, and are shown for comparison."
        + (" **Quick run: a tenth of the data.**" if result["quick"] else ""),
        f"Data: {frames}; seed {result['seed']}.",
        "Frames of one recording are similar, so the paper's split by frames at random leaks. The valid score is of"
        " the split by object. Brackets are 95 % intervals, bootstrapped over recordings. Scores are of the frames"
        " that a model answers; it gives no answer without all its signals. Of all frames: those taken as"
        " rest.",
        "Fitted on at most this many windows, drawn at random to save time: "
        + ", ".join(f"{name} {count}" for name, count in most(quick=result["quick"]).items())
        + ("." if result["quick"] else " (for unseen objects all models had all windows)."),
        "## Detection, five folds",
        _cross_validation(rows),
        "## Detection, objects never seen",
        _unseen(rows),
        "## Severity, one object left out at a time",
        "To save time "
        + (
            f"one of {FEW_GROUPS} groups of objects."
            if result["quick"]
            else f"{' and '.join(OWN_ESTIMATORS)}, not the paper's, leave out one of {GROUPS} groups of objects;"
            f" with labels shuffled one of {FEW_GROUPS}, and at most "
            + " and ".join(f"{count} windows for {name}" for name, count in SHUFFLED_MOST.items())
            + "."
        ),
        _leave_one_out(rows),
        "## Severity, objects never seen",
        _severity_unseen(rows),
        "## Severity, the pipe",
        _severity(rows, "pipe", "all", printed.PIPE),
    ]
    if result["failed"]:
        parts += ["## Not measured", *(f"- {item['job']}: {item['reason']}" for item in result["failed"])]
    return "\n\n".join(parts) + "\n"


def _cross_validation(rows: list[Row]) -> str:
    header = (
        "model",
        "signals",
        "split",
        "labels",
        "accuracy %",
        "precision",
        "recall",
        "F1",
        "AUC",
        "onset ms",
        "missed %",
        "false alarms/min",
        "answered %",
        "printed A/P/R/F1",
    )
    found = [row for row in rows if row["table"] == "cross-validation"]
    order = {"frames": 0, "recording": 1, "object": 2, "-": 3}
    found.sort(
        key=lambda row: (order.get(row["split"], 9), row["labels"], row["control"], row["model"], row["signals"])
    )
    lines = []
    for row in found:
        given = printed.CROSS_VALIDATION.get((row["learner"], row["signals"])) if row["split"] == "frames" else None
        lines.append(
            (
                row["model"],
                "" if row["control"] else row["signals"],
                row["split"],
                row["labels"],
                _accuracy(row),
                *(_percent(row.get(key)) for key in ("precision", "recall", "f1")),
                _number(row.get("auc"), 3),
                *_alarms(row),
                " / ".join(f"{v:.2f}" for v in given) if given and row["labels"] == "measured" else "",
            )
        )
    return _table(header, lines)


def _unseen(rows: list[Row]) -> str:
    header = (
        "model",
        *UNSEEN,
        "mean",
        "mean of all frames",
        "false positives on the sponge",
        "onset ms",
        "missed %",
        "false alarms/min",
        "answered %",
        "printed: " + ", ".join(UNSEEN),
    )
    own = [row for row in rows if row["table"] == "unseen"]
    lines = []
    for model in dict.fromkeys(row["model"] for row in own):
        by = {row["object"]: row for row in own if row["model"] == model}
        mean, mean_all = (sum(by[name][key] for name in UNSEEN) / len(UNSEEN) for key in ("accuracy", "accuracy_all"))
        given = [printed.UNSEEN_ACCURACY.get((model, name)) for name in UNSEEN]
        lines.append(
            (
                model,
                *(_accuracy(by[name]) for name in UNSEEN),
                _percent(mean),
                _percent(mean_all),
                _number(by["sponge"]["false_positive_rate"], 3),
                *_alarms(by["all"]),
                ", ".join(_number(v, 1) for v in given),
            )
        )
    return _table(header, lines)


_SEVERITY = (
    "MAE cm/s",
    "RMSE",
    "R2",
    "MAE moving",
    "R2 moving",
    "90 % intervals cover (moving)",
    "angular error",
    "its intervals cover (turning)",
    "answered %",
    "printed MAE/RMSE/R2",
)


def _severity_cells(row: Row, given: tuple[float, float, float] | None) -> tuple[str, ...]:
    mae = _number(row["mae"], 2, 100)
    if row.get("mae_low") is not None:
        mae += f" [{_number(row['mae_low'], 2, 100)}, {_number(row['mae_high'], 2, 100)}]"
    return (
        mae,
        _number(row["rmse"], 2, 100),
        _number(row["r2"], 2),
        _number(row["moving_mae"], 2, 100),
        _number(row["moving_r2"], 2),
        _covers(row, "coverage", "moving_coverage"),
        _percent(row.get("angular_relative_error")),
        _covers(row, "angular_coverage", "turning_coverage"),
        _percent(row.get("answered")),
        " / ".join(f"{v:.2f}" for v in given) if given else "",
    )


def _leave_one_out(rows: list[Row]) -> str:
    lines = []
    for row in (row for row in rows if row["table"] == "leave-one-out"):
        given = printed.LEAVE_ONE_OUT.get((row["learner"], row["signals"]))
        labels = row["labels"]
        lines.append((row["model"], "" if row["control"] else row["signals"], labels, *_severity_cells(row, given)))
    return _table(("model", "signals", "labels", *_SEVERITY), sorted(lines))


def _severity_unseen(rows: list[Row]) -> str:
    lines = []
    own = [row for row in rows if row["table"] == "severity-unseen"]
    for name in (*UNSEEN, "all"):
        for row in (row for row in own if row["object"] == name):
            given = printed.SEVERITY_UNSEEN.get((row["model"], name))
            lines.append((name, row["model"], *_severity_cells(row, given)))
    return _table(("object", "model", *_SEVERITY), lines)


def _severity(rows: list[Row], table: str, name: str, given: dict[str, tuple[float, float, float]]) -> str:
    own = [row for row in rows if row["table"] == table and row["object"] == name]
    lines = [(row["model"], *_severity_cells(row, given.get(row["model"]))) for row in own]
    return _table(("model", *_SEVERITY), lines)


def _accuracy(row: Row) -> str:
    text = _percent(row["accuracy"])
    if row.get("accuracy_low") is not None:
        text += f" [{_percent(row['accuracy_low'])}, {_percent(row['accuracy_high'])}]"
    return text


def _alarms(row: Row) -> tuple[str, ...]:
    return (
        _number(row.get("onset_latency_s"), 0, 1e3),
        _percent(row.get("onsets_missed")),
        _number(row.get("false_alarms_per_min"), 1),
        _percent(row.get("answered")),
    )


def _covers(row: Row, whole: str, part: str) -> str:
    return f"{_percent(row.get(whole))} ({_percent(row.get(part))})" if row.get(whole) is not None else "-"


def _percent(value: float | None) -> str:
    return _number(value, 1, 100)


def _number(value: float | None, digits: int, times: float = 1.0) -> str:
    return "-" if value is None or value != value else f"{value * times:.{digits}f}"


def _table(header: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    rows = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(rows + ["| " + " | ".join(line) + " |" for line in lines])
