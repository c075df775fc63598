"""Accuracy against time, and against the length of the window."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lsds.session.pictures.figure import new_figure

if TYPE_CHECKING:
    from lsds.contracts.study import Value

MARKS = {"baseline": "v", "proposed": "s", "combined": "D", "field": "o", "own": "o", "untrained": "X"}

_FAILED_SCORE = -0.5
"""A score below this means failure: the model is named at the lower edge, not to scale."""


def plot(path: Path, rows: list[dict[str, Value]], score: str, title: str) -> None:
    """Write a PNG: left all models, the Pareto front joined; right score by length of the window."""
    figure = new_figure(12, 5)
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    names = list(dict.fromkeys(str(row["model"]) for row in rows))
    # The scale ignores models that are far worse than the trivial prediction.
    least = min((_y(row) for row in rows if _y(row) > _FAILED_SCORE), default=0.0) - 0.02
    for row in rows:
        color = f"C{names.index(str(row['model']))}"
        if _y(row) < least:
            left.annotate(
                f"{row['model']}: {_y(row):.1f}",
                (_x(row), least),
                (0, 6),
                textcoords="offset points",
                fontsize=7,
                ha="center",
            )
            left.plot(_x(row), least, "v", color=color, clip_on=False)
            continue
        left.plot(
            _x(row),
            _y(row),
            MARKS.get(str(row["signals"]), "o"),
            color=color,
            ms=7 if row["front"] else 4,
            mec="k" if row["front"] else color,
            mew=0.8,
        )
    front = sorted((row for row in rows if row["front"]), key=_x)
    left.plot([_x(row) for row in front], [_y(row) for row in front], "-", color="0.6", lw=1, zorder=0)
    for name in names:
        left.plot([], [], "o", color=f"C{names.index(name)}", label=name)
    for signals, mark in MARKS.items():
        if any(row["signals"] == signals for row in rows) and signals != "own":
            left.plot([], [], mark, color="0.4", label=signals, ls="")
    left.set_xscale("log")
    left.set_xlabel("time of an update (us)")
    left.set_ylabel(score)
    left.legend(fontsize=7, frameon=False, ncols=2)
    for name in names:
        own = sorted((row for row in rows if row["model"] == name and row["signals"] == "own"), key=_length)
        if len(own) > 1:
            color = f"C{names.index(name)}"
            right.plot([_length(row) for row in own], [_y(row) for row in own], "o-", color=color, label=name)
            low, high = ([float(row[key] or 0) for row in own] for key in ("low", "high"))
            right.fill_between([_length(row) for row in own], low, high, color=color, alpha=0.12, lw=0)
    right.set_xlabel("frames in the window")
    right.legend(fontsize=8, frameon=False)
    for ax in (left, right):
        ax.grid(alpha=0.3)
    figure.suptitle(title, fontsize=10)
    figure.savefig(path, dpi=110)


def _x(row: dict[str, Value]) -> float:
    return float(row["update_us"] or 0)


def _y(row: dict[str, Value]) -> float:
    return float(row["score"] or 0)


def _length(row: dict[str, Value]) -> int:
    return int(row["length"] or 0)
