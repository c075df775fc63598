"""Train the models that are shipped: `python -m lsds_plugins.models.make DATA`.

DATA holds the datasets `detection` and `severity` (`lsds collect`, or data/ of `lsds reproduce`). Nothing is learnt
from the five unseen objects, nor from the pipe.
"""

from __future__ import annotations

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

SHIPPED = {
    "detection": ("gradient-boosting", "random-forest", "field-mlp", "logistic", "monotone"),
    "severity": ("lstm", "field-gru", "mlp", "linear-window"),
}
"""Learners by dataset, the slowest first."""


def train(dataset: str, learner: str, folder: str) -> str:
    """Train one; return what its card says of it."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    import numpy as np

    from lsds.learning.collect.objects import SEEN
    from lsds.learning.datasets import load
    from lsds.learning.evaluation.fitting import Model
    from lsds.learning.evaluation.shipping import train as fit
    from lsds.plugins.host import PluginHost

    data = load(Path(folder) / dataset)
    seen = data.where(np.isin(data["object"], SEEN))
    card = fit(seen, Model(learner), PluginHost(), Path(__file__).parent / f"{learner}.onnx")
    return f"{learner}: {dict(card.scores or {})}"


def main(arguments: list[str]) -> int:
    """Train all, or those named after DATA."""
    if not arguments:
        print(__doc__, file=sys.stderr)
        return 2
    folder, *named = arguments
    todo = [(data, name) for data, names in SHIPPED.items() for name in names if not named or name in named]
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        for future in [pool.submit(train, data, name, folder) for data, name in todo]:
            print(future.result(), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
