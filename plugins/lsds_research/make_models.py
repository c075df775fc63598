"""Train the shipped models: `python -m lsds_research.make_models DATA`.

DATA holds the datasets `detection`, `severity`, `catch` and `loads` (`lsds learn collect`). The five held-out objects
and the pipe are not used for training. `fused` is trained on `detection`, `loads` and `labelled`, a folder (or a link
to one) of real recordings labelled by eye, without the objects that are only scored. Estimators are trained on
severity, catch and detection. Severity contains no held load: an estimator trained on it alone takes a held load for a
slow slip. A third of detection is enough, because most of it is at rest.

`python -m lsds_research.make_models --real FOLDER` then measures the detectors on real recordings labelled by eye and
writes the scores to their cards; training a model again removes them. `--reliability DATA` (five minutes) then fits
`fused` without each object in turn and writes the probability of each score to its card. `--fusion FOLDER` does so on
real frames only, and writes how the detector combines its trees with `imprint`.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.cli.threads import one_thread, processes
from lsds.support.processes import DIED, spread

if TYPE_CHECKING:
    from lsds_research.datasets import Dataset

LABELLED, REAL, RELIABILITY, FUSION = "labelled", "--real", "--reliability", "--fusion"
SHIPPED = {
    "detection": ("gradient-boosting", "random-forest", "field-mlp", "logistic", "monotone", "fused"),
    "severity": ("lstm", "imprint-gru", "field-gru", "mlp", "linear-window"),
}
"""Learners by dataset, the slowest first."""
DATASETS = {
    "detection": {"detection": 1, "catch": 1},
    "severity": {"severity": 1, "catch": 1, "detection": 3},
}
"""Training datasets by job, and N: one recording in N is used."""
OWN = {
    "fused": {"detection": 3, "loads": 1, LABELLED: 1},
    "imprint-gru": {**DATASETS["severity"], "loads": 2},
}
"""Training datasets of learners with other needs. `fused` has few real frames; simulated ones must not outvote them."""
FUSED_THRESHOLD = 0.75
"""Threshold of the trees of `fused` alone: with each of the 20 fitted objects left out in turn, it detects 85 % of the
slips, with false alarms in 3.5 of 100 moving frames.

A score is not a probability on real frames, because training uses simulated frames too; the card maps scores to
probabilities (`real.reliability`). `lsds calibrate slip` finds the threshold of a cell.
"""


def learns_from(job: str, learner: str) -> dict[str, int]:
    """Return the training datasets of a shipped model, each with N: one recording in N is used."""
    return OWN.get(learner, DATASETS[job])


def train(which: tuple[str, str], folder: str) -> str:
    """Train one model; return the scores of its card."""
    from lsds_plugins.models import model_path

    from lsds.registry.host import PluginHost
    from lsds_research.datasets import load, merged
    from lsds_research.evaluation.detection import THRESHOLD
    from lsds_research.evaluation.fitting import Model
    from lsds_research.evaluation.shipping import train as fit

    dataset, learner = which
    parts = []
    for name, every in learns_from(dataset, learner).items():
        whole = _labelled(Path(folder) / name) if name == LABELLED else load(Path(folder) / name)
        parts.append((name, whole if name == LABELLED else training_part(whole, every)))
    threshold = FUSED_THRESHOLD if learner == "fused" else THRESHOLD
    card = fit(merged(parts), Model(learner, own=True), PluginHost(), model_path(learner, ""), threshold=threshold)
    return f"{learner}: {dict(card.scores or {})}"


def training_part(data: Dataset, every: int) -> Dataset:
    """Return every N-th recording of the training objects in a simulated dataset.

    Raises DataError if it has none.
    """
    import numpy as np

    from lsds.errors import DataError
    from lsds_research.collecting.objects import SEEN

    seen = data.where(np.isin(data["object"], SEEN))
    if not len(seen):
        raise DataError(f"the dataset has none of the training objects ({', '.join(SEEN)}); collect it with them")
    return seen.where(np.isin(seen["recording"], np.unique(seen["recording"])[::every]))


def _labelled(folder: Path) -> Dataset:
    """Return the labelled frames of the objects that are tuned on."""
    import numpy as np

    from lsds_research.slips.folder import as_dataset, labels_of, read_folder, scored_only

    whole = as_dataset(read_folder(folder, labels_of(folder))[0])
    return whole.where(~np.isin(whole["object"], list(scored_only())))


def _measure(folder: Path) -> int:
    """Write the scores on real recordings to the cards."""
    from lsds_research.slips.on_cards import write_on_cards

    one_thread()
    for name, real in write_on_cards(folder, SHIPPED["detection"], SHIPPED["severity"], processes()).items():
        print(f"{name}: {real.get('scores', '')} fitted on {real['fitted_on']['frames']} real frames", flush=True)
    return 0


def _write_reliability(folder: Path) -> int:
    """Write the probabilities of scores to the card of `fused`."""
    from lsds_research.datasets import load, merged
    from lsds_research.slips.folder import labels_of, read_folder, scored_only
    from lsds_research.slips.refit import refitted
    from lsds_research.slips.reliability import reliability

    one_thread()
    real = folder / LABELLED
    recordings = read_folder(real, labels_of(real), jobs=processes())[0]
    fitted = [own for own in recordings if own.object not in scored_only()]
    parts = [(name, training_part(load(folder / name), n)) for name, n in OWN["fused"].items() if name != LABELLED]
    scores = refitted(fitted, lambda own: own.object, merged(parts))
    if scores is None:
        return 1
    return _write_on_card("reliability", reliability(fitted, scores))


def _write_fusion(folder: Path) -> int:
    """Write how `fused` combines trees and imprint to its card."""
    from lsds_research.slips.folder import labels_of, read_folder, scored_only
    from lsds_research.slips.fusion import fitted_fusion
    from lsds_research.slips.refit import refitted

    one_thread()
    recordings = read_folder(folder, labels_of(folder), ("imprint",), jobs=processes())[0]
    fitted = [own for own in recordings if own.object not in scored_only()]
    scores = refitted(fitted, lambda own: own.object)
    if scores is None:
        return 1
    return _write_on_card("fusion", fitted_fusion(fitted, scores))


def _write_on_card(name: str, found: dict[str, Any]) -> int:
    """Write an entry of `real` to the card of `fused`, and print it."""
    import json

    from lsds_plugins.models import model_path

    from lsds.support.files import write_whole

    path = model_path("fused", "").with_suffix(".json")
    card = json.loads(path.read_text(encoding="utf-8"))
    card["real"] = {**card.get("real", {}), name: found}
    write_whole(path, (json.dumps(card, indent=2, allow_nan=False) + "\n").encode())
    print(found)
    return 0


def main(arguments: list[str]) -> int:
    """Train all, or those named after DATA; or measure all on real recordings."""
    if not arguments or (arguments[0] in (REAL, RELIABILITY, FUSION) and len(arguments) != 2):
        print(__doc__, file=sys.stderr)
        return 2
    if arguments[0] == RELIABILITY:
        return _write_reliability(Path(arguments[1]))
    if arguments[0] == FUSION:
        return _write_fusion(Path(arguments[1]))
    if arguments[0] == REAL:
        return _measure(Path(arguments[1]))
    folder, *named = arguments
    todo = [(data, name) for data, names in SHIPPED.items() for name in names]
    unknown = set(named) - {name for _, name in todo}
    if unknown:
        print(f"no learner {', '.join(sorted(unknown))}; there are {', '.join(n for _, n in todo)}", file=sys.stderr)
        return 2
    chosen = [which for which in todo if not named or which[1] in named]
    one_thread()
    died = 0
    for (_, name), outcome in spread(partial(train, folder=folder), chosen, processes()):
        print(outcome or f"{name}: {DIED}", flush=True)
        died += outcome is None
    return 1 if died else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
