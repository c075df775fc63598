"""The picture of the study: ROC curves of models and controls, and the causal score against the fraction of a
recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lsds.session.pictures.figure import new_figure
from lsds_research.incipient.folds import by_recording
from lsds_research.incipient.online import PARTS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.incipient.causal import Causal, Curve
    from lsds_research.incipient.table import Videos

    Floats = NDArray[np.float64]


def draw(path: Path, videos: Videos, curves: Sequence[Curve], courses: Causal | None) -> None:
    """Write the picture."""
    figure = new_figure(13, 7)
    left, right = figure.subplots(1, 2)
    for number, curve in enumerate(curves):
        true = by_recording(curve.recordings, curve.slip.astype(np.float64)) > 0.5
        by_name = by_recording(curve.recordings, curve.probability)
        false, found = roc(true, by_name)
        first = number == 0
        left.plot(false, found, lw=2.5 if first else 1.3, ls="-" if first else "--", label=curve.name)
    left.plot([0, 1], [0, 1], color="0.8", lw=1, zorder=0)
    left.set_xlabel("share of recordings without slip that are classified as slip")
    left.set_ylabel("share of recordings with slip that are found")
    handles, labels = left.get_legend_handles_labels()
    title = "AUC, mean of repeats; the curve is of the first"
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=7, title=title, title_fontsize=8)
    left.set_title("whole recordings, objects not trained on", fontsize=10)
    if courses is None:
        right.set_axis_off()
    else:
        for name, values in courses.parts.items():
            right.plot(PARTS, values, "o-", ms=4, label=f"running {name} of windows")
        right.axhline(courses.leaks["by_object"], color="0.5", lw=1, ls=":", label="one window alone")
        right.axhline(0.5, color="0.8", lw=1, zorder=0)
        right.set_ylim(0.45, 1.0)
        right.set_xlabel("elapsed share of the recording")
        right.set_ylabel("AUC")
        right.legend(fontsize=8, loc="lower right")
        right.set_title("online: causal, objects not trained on", fontsize=10)
    count = len(np.unique(videos.recording))
    figure.suptitle(
        f"Slip in {count} real recordings of {len(np.unique(videos.object))} objects (measured)", fontsize=11
    )
    figure.savefig(path, dpi=110)


def roc(slip: NDArray[np.bool_], probability: Floats) -> tuple[Floats, Floats]:
    """Return false and true positive rates over all thresholds, (k,) each, from (0, 0) to (1, 1)."""
    order = np.argsort(-probability, kind="stable")
    ends = np.flatnonzero(np.diff(probability[order], append=-np.inf))  # Ties are passed together.
    true = np.cumsum(slip[order])[ends] / max(1, int(slip.sum()))
    false = np.cumsum(~slip[order])[ends] / max(1, int((~slip).sum()))
    return np.concatenate([[0.0], false]), np.concatenate([[0.0], true])
