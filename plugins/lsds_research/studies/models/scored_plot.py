"""Scores of models, object by object."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lsds.session.pictures.figure import new_figure

if TYPE_CHECKING:
    from lsds.contracts.study import Value


def plot(path: Path, rows: list[dict[str, Value]], score: tuple[str, str, str, str], title: str) -> None:
    """Write a PNG: one line per model, one dot per object, a bar with its interval for all objects. `score`: its key,
    its heading, the keys of its interval's ends."""
    key, heading, *ends = score
    models = list(dict.fromkeys(str(row["model"]) for row in rows))
    objects = [name for name in dict.fromkeys(str(row["object"]) for row in rows) if name != "all"]
    figure = new_figure(9, 1.6 + 0.42 * len(models))
    ax = figure.subplots()
    for row in rows:
        at, value = models.index(str(row["model"])), row[key]
        if value is None:
            continue
        if row["object"] == "all":
            ax.plot([float(value)], [at], "|", color="k", ms=16, mew=2)
            low, high = (row.get(end) for end in ends)
            if low is not None and high is not None:
                ax.plot([float(low), float(high)], [at, at], color="k", lw=1)
        else:
            ax.plot([float(value)], [at], "o", color=f"C{objects.index(str(row['object'])) % 10}", ms=5, alpha=0.8)
    for index, name in enumerate(objects):
        ax.plot([], [], "o", color=f"C{index % 10}", ms=5, label=name)
    ax.plot([], [], "|", color="k", ms=12, mew=2, label="all, 95 % interval")
    ax.set_yticks(range(len(models)), models)
    ax.invert_yaxis()
    ax.set_xlabel(heading)
    ax.grid(alpha=0.3)
    figure.legend(loc="outside lower center", ncols=6, fontsize=8, frameon=False)
    figure.suptitle(title, fontsize=10)
    figure.savefig(path, dpi=110)
