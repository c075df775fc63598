"""Train the models that are shipped: `python -m lsds_plugins.models.make DATA`.

DATA holds the datasets `detection` and `severity` (`lsds collect`, or data/ of `lsds reproduce`). Nothing is learnt
from the five unseen objects, nor from the pipe. Estimators learn from both: in severity's protocol nothing is ever
held, and what has never seen a load that does not slip takes it for a slow slip.
"""

from __future__ import annotations

import os
import sys
from functools import partial
from pathlib import Path

from lsds.cli.threads import one_thread
from lsds.processes import DIED, spread

SHIPPED = {
    "detection": ("gradient-boosting", "random-forest", "field-mlp", "logistic", "monotone"),
    "severity": ("lstm", "field-gru", "mlp", "linear-window"),
}
"""Learners by dataset, the slowest first."""
DATASETS = {"detection": ("detection",), "severity": ("severity", "detection")}
MOST = {"field-gru": 60_000, "lstm": 60_000}
"""Windows that these are fitted on at most, drawn from all, so that it takes minutes and not an hour."""


def train(which: tuple[str, str], folder: str) -> str:
    """Train one, dataset and learner; return what its card says of it."""
    import numpy as np

    from lsds.learning.collect.objects import SEEN
    from lsds.learning.datasets import joined, load
    from lsds.learning.evaluation.fitting import Model
    from lsds.learning.evaluation.shipping import train as fit
    from lsds.plugins.host import PluginHost

    dataset, learner = which
    parts = [load(Path(folder) / name) for name in DATASETS[dataset]]
    data = joined([part.columns for part in parts], {**parts[0].card, "job": ", ".join(DATASETS[dataset])})
    seen = data.where(np.isin(data["object"], SEEN))
    card = fit(seen, Model(learner, most=MOST.get(learner, 0)), PluginHost(), Path(__file__).parent / f"{learner}.onnx")
    return f"{learner}: {dict(card.scores or {})}"


def main(arguments: list[str]) -> int:
    """Train all, or those named after DATA."""
    if not arguments:
        print(__doc__, file=sys.stderr)
        return 2
    folder, *named = arguments
    todo = [(data, name) for data, names in SHIPPED.items() for name in names]
    unknown = set(named) - {name for _, name in todo}
    if unknown:
        print(f"no learner {', '.join(sorted(unknown))}; there are {', '.join(n for _, n in todo)}", file=sys.stderr)
        return 2
    chosen = [which for which in todo if not named or which[1] in named]
    one_thread()
    died = 0
    for (_, name), told in spread(partial(train, folder=folder), chosen, os.cpu_count() or 1):
        print(told or f"{name}: {DIED}", flush=True)
        died += told is None
    return 1 if died else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
