"""The entry `real` of model cards: recordings used for fitting, and the scores of a detector on the others."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from lsds_plugins.models import model_path

from lsds.support.files import write_whole
from lsds_research.slips.folder import as_dataset, labels_of, read_folder, scored_only
from lsds_research.slips.labels import PROTOCOL
from lsds_research.slips.score import Counts, counted

if TYPE_CHECKING:
    from lsds_research.slips.folder import LabelledRecording


def write_on_cards(
    folder: Path, detectors: Sequence[str], estimators: Sequence[str] = (), jobs: int = 1
) -> dict[str, dict[str, Any]]:
    """Measure the shipped detectors on a folder of labelled recordings; fill in `real` on the cards, and return it.

    A model fitted on real recordings uses those of the objects that are not scored only; scores are of the objects
    that are. Raises DataError for a folder or labels that cannot be used.
    """
    recordings, _ = read_folder(folder, labels_of(folder), detectors, (), jobs)
    scored = [own for own in recordings if own.object in scored_only()]
    others = [own for own in recordings if own.object not in scored_only()]
    written = {}
    for name in (*detectors, *estimators):
        path = model_path(name, "").with_suffix(".json")
        card = json.loads(path.read_text(encoding="utf-8"))
        learnt = others if PROTOCOL in card["trained_on"].get("datasets", {}) else []
        kept = {key: value for key, value in (card.get("real") or {}).items() if key in ("reliability", "fusion")}
        card["real"] = {"fitted_on": fitted_on(learnt), **kept}
        if name in detectors:
            card["real"] |= {"scored_on": _extent(scored), "scores": real_scores(scored, name)}
        write_whole(path, (json.dumps(card, indent=2, allow_nan=False) + "\n").encode())
        written[name] = card["real"]
    return written


def fitted_on(recordings: Sequence[LabelledRecording]) -> dict[str, Any]:
    """Return the recordings and the number of their training frames."""
    if not recordings:
        return {"recordings": [], "frames": 0}
    frames = int(np.count_nonzero(as_dataset(recordings)["slip"] >= 0))
    return {"recordings": sorted(own.outputs.name for own in recordings), "frames": frames}


def real_scores(recordings: Sequence[LabelledRecording], detector: str) -> dict[str, float | None]:
    """Return a detector's scores at its own threshold: frames found, slips noticed, false alarms; None if undefined."""
    counts = Counts()
    for own in recordings:
        counts += counted(own.with_slip(own.outputs.slip[detector]))
    figures = {
        "found": counts.recall,
        "noticed": counts.noticed_share,
        "false_alarms_per_100_moving": counts.per_100_moving,
        "false_alarms_per_100_still": counts.per_100_still,
        "answered": counts.answered / counts.frames if counts.frames else float("nan"),
    }
    return {name: round(value, 4) if np.isfinite(value) else None for name, value in figures.items()}


def _extent(recordings: Sequence[LabelledRecording]) -> dict[str, Any]:
    counts = Counts()
    for own in recordings:
        counts += counted(own.with_slip(np.zeros(own.outputs.count)))
    return {
        "labels": "by eye",
        "objects": sorted({own.object for own in recordings}),
        "recordings": len(recordings),
        "slips": counts.intervals,
        "frames": counts.frames,
    }
