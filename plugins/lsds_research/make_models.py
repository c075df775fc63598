"""Train the shipped models: `python -m lsds_research.make_models DATA`.

DATA holds the datasets `detection`, `severity` and `catch` (`lsds collect`). The five held-out objects and the pipe are
not used for training. Estimators are trained on all three: severity contains no held load, and an estimator trained on
it alone takes a held load for a slow slip. A third of detection is enough, because most of it is at rest.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

from lsds.cli.threads import one_thread, processes
from lsds.processes import DIED, spread

SHIPPED = {
    "detection": ("gradient-boosting", "random-forest", "field-mlp", "logistic", "monotone"),
    "severity": ("lstm", "field-gru", "mlp", "linear-window"),
}
"""Learners by dataset, the slowest first."""
DATASETS = {
    "detection": {"detection": 1, "catch": 1},
    "severity": {"severity": 1, "catch": 1, "detection": 3},
}
"""Training data by job; one in so many recordings of each dataset."""


def train(which: tuple[str, str], folder: str) -> str:
    """Train one model; return the scores of its card."""
    import numpy as np

    from lsds.plugins.host import PluginHost
    from lsds_research.collecting.objects import SEEN
    from lsds_research.datasets import load, merged
    from lsds_research.evaluation.fitting import Model
    from lsds_research.evaluation.shipping import train as fit

    dataset, learner = which
    parts = []
    for name, every in DATASETS[dataset].items():
        whole = load(Path(folder) / name)
        seen = whole.where(np.isin(whole["object"], SEEN))
        kept = np.isin(seen["recording"], np.unique(seen["recording"])[::every])
        parts.append((name, seen.where(kept)))
    card = fit(merged(parts), Model(learner), PluginHost(), Path(__file__).parent / f"{learner}.onnx")
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
    for (_, name), told in spread(partial(train, folder=folder), chosen, processes()):
        print(told or f"{name}: {DIED}", flush=True)
        died += told is None
    return 1 if died else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
