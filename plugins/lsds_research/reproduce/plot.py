"""The picture of the reproduction: accuracy by split, accuracy on held-out objects, severity compared with
baselines."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from lsds.session.pictures.figure import new_figure
from lsds_research.collecting.objects import UNSEEN

_SPLITS = ("frames", "recording", "object")
_MODELS = ("random-forest", "gradient-boosting", "logistic", "field-mlp", "one-parameter rule")


def plot_reproduction(path: Path, result: dict[str, Any]) -> None:
    """Write a PNG. Raises OSError if it cannot be written."""
    rows = result["rows"]
    figure = new_figure(13, 8)
    (top_left, top_right), (low_left, low_right) = figure.subplots(2, 2)
    _splits(top_left, rows)
    _objects(top_right, rows)
    _severity(low_left, rows, "leave-one-out", "Severity, objects left out: mean absolute error")
    _severity(
        low_right,
        [row for row in rows if row.get("object") == "all"],
        "severity-unseen",
        "Severity, unseen objects: mean absolute error",
    )
    quick = ", quick run" if result["quick"] else ""
    figure.suptitle(f"The study's tables on simulated data (seed {result['seed']}{quick})")
    figure.savefig(path, dpi=110)


def _splits(ax: Any, rows: list[dict[str, Any]]) -> None:
    own = [row for row in rows if row["table"] == "cross-validation" and row["split"] in _SPLITS]
    own = [row for row in own if row["signals"] in ("own", "combined")]
    names = list(dict.fromkeys(_title(row) for row in own))
    for index, name in enumerate(names):
        by = {row["split"]: row for row in own if _title(row) == name}
        control = "shuffled" in name or "nuisance" in name
        at = [k for k, split in enumerate(_SPLITS) if split in by]
        values = [100 * by[_SPLITS[k]]["accuracy"] for k in at]
        color = f"C{len(_MODELS) + index % 5}" if control else _color(by[_SPLITS[at[0]]]["model"])
        ax.plot(at, values, "x:" if control else "o-", color=color, label=name, ms=6)
    majority = next((row for row in rows if row["table"] == "cross-validation" and row["model"] == "majority"), None)
    if majority:
        ax.axhline(100 * majority["accuracy"], color="0.5", lw=1, ls="--", label="majority")
    ax.set_xticks(range(3), ["by frame (leaks)", "by recording", "by object"])
    ax.set_ylabel("accuracy (%)")
    ax.set_title("Detection by split", fontsize=10)
    ax.legend(fontsize=7, frameon=False)
    ax.grid(alpha=0.3)


def _objects(ax: Any, rows: list[dict[str, Any]]) -> None:
    # The controls are in the table only; here they would compress the scale.
    own = [row for row in rows if row["table"] == "unseen" and row["model"] in _MODELS]
    models = list(dict.fromkeys(row["model"] for row in own))
    width = 0.8 / max(len(models), 1)
    for index, model in enumerate(models):
        by = {row["object"]: row for row in own if row["model"] == model}
        values = np.array([100 * by[name]["accuracy"] for name in UNSEEN])
        low = values - [100 * by[name]["accuracy_low"] for name in UNSEEN]
        high = np.array([100 * by[name]["accuracy_high"] for name in UNSEEN]) - values
        at = np.arange(len(UNSEEN)) + (index - (len(models) - 1) / 2) * width
        errors = np.maximum(np.stack([low, high]), 0)
        ax.bar(at, values, width, yerr=errors, label=model, color=_color(model), error_kw={"lw": 0.8})
    ax.set_xticks(range(len(UNSEEN)), UNSEEN)
    ax.set_ylim(50, 101)
    ax.set_ylabel("accuracy (%)")
    ax.set_title("Detection on objects never seen", fontsize=10)
    ax.legend(fontsize=7, loc="lower center", ncols=3, framealpha=0.9)


def _color(model: str) -> str:
    """Return a model's color, the same in every panel."""
    return f"C{_MODELS.index(model)}" if model in _MODELS else "0.3"


def _severity(ax: Any, rows: list[dict[str, Any]], table: str, title: str) -> None:
    own = sorted((row for row in rows if row["table"] == table), key=lambda row: -row["mae"])
    at = np.arange(len(own))
    colors = ["0.7" if row["control"] or row["labels"] == "shuffled" else "C0" for row in own]
    ax.barh(at, [100 * row["mae"] for row in own], color=colors, label="all frames")
    ax.plot([100 * row["moving_mae"] for row in own], at, "k|", ms=9, label="moving only")
    ax.set_yticks(at, [_title(row) for row in own], fontsize=7)
    ax.set_xlabel("cm/s (grey: learns nothing, or there is nothing to learn)")
    ax.set_title(title, fontsize=10)
    ax.legend(fontsize=7, frameon=False)


def _title(row: dict[str, Any]) -> str:
    signals = f" {row['signals']}" if row["signals"] != "own" and row["learner"] and not row["control"] else ""
    named = row["labels"] != "shuffled" or "shuffled" in row["model"]
    return f"{row['model']}{signals}" + ("" if named else " (shuffled)")
