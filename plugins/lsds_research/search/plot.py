"""The picture of a search: the minimum margin over the runs, and the keys that failures have in common."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lsds.session.pictures.figure import new_figure


def plot_search(path: Path, rows: Sequence[dict[str, Any]], keys: Sequence[str]) -> None:
    """Write the picture: margins in the order of the runs, and the values of each key in failures and in other runs."""
    figure = new_figure(11, 5.5)
    left, right = figure.subplots(1, 2)
    margins = np.array([row["margin"] for row in rows])
    failed = margins < 0
    at = np.arange(len(rows))
    left.plot(at[~failed], margins[~failed], ".", color="tab:blue", label="not failed")
    left.plot(at[failed], margins[failed], "x", color="tab:red", label="failed")
    left.axhline(0, color="k", lw=0.8)
    left.set_xlabel("run")
    left.set_ylabel("least margin (simulated)")
    left.legend(fontsize=8)
    left.grid(alpha=0.25)
    for row, key in enumerate(keys):
        places = _places([item["scenario"].get(key) for item in rows])
        right.plot(places[~failed], np.full((~failed).sum(), row + 0.15), "|", color="0.75", ms=5)
        right.plot(places[failed], np.full(failed.sum(), row - 0.15), "|", color="tab:red", ms=8)
    right.set_yticks(range(len(keys)), _short(keys), fontsize=8)
    right.set_xticks([0, 1], ["least", "greatest"])
    right.set_title("values of each key: failed red, others grey", fontsize=10)
    figure.savefig(path, dpi=110)


def _short(keys: Sequence[str]) -> list[str]:
    """Return the last part of each key, with the part before it where several keys end in the same way."""
    ends = Counter(key.rpartition(".")[2] for key in keys)
    return [".".join(key.split(".")[-1 if ends[key.rpartition(".")[2]] == 1 else -2 :]) for key in keys]


def _places(values: Sequence[Any]) -> NDArray[np.float64]:
    """Return values scaled to 0 to 1: numbers by size, names by their order."""
    if all(isinstance(value, int | float) for value in values):
        numbers = np.array(values, float)
        span = float(np.ptp(numbers)) or 1.0
        return np.asarray((numbers - numbers.min()) / span)
    names = sorted({str(value) for value in values})
    return np.array([names.index(str(value)) / max(len(names) - 1, 1) for value in values])
