"""A certificate against plain counting and a boundary search, on the same number of lifts.

`python -m tests.research.certify.boundary_search --runs 304 --held-out 600 --repeats 3 --out FILE [--jobs 2]` spends
the lifts in three ways, and fits the same two models to each way's outcomes: the forest of the certificate, and a
logistic regression. Both rank other lifts, drawn evenly; so does the needed force alone, the trivial baseline, and a
forest on shuffled outcomes. FILE stores the lifts, so that an interrupted comparison continues. Figures are simulated.

The boundary search has the two stages of RoboGate (arXiv:2603.22126): two thirds of the lifts by Latin hypercube, the
rest where a model of those expects 30 to 70 % failures.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Generator, Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from lsds_research.certify.needed_force import NeededForce
from lsds_research.certify.sequential import RUNS_PER_BATCH, Describe, Floats, Points, fitted_forest, plain, sequential
from lsds_research.certify.study import QUICK, USUAL_SLIP_MM, drop_margin
from lsds_research.search.objects import OBJECTS, completed
from lsds_research.search.robustness import Limits
from lsds_research.search.scenarios import Scenarios
from scipy.stats import qmc
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import roc_auc_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

FIRST = 40_000
"""Seed of the first repetition; no other draw in the tree uses seeds from here on."""
COARSE_SHARE = 2 / 3
"""Share of the lifts in the first stage of the boundary search."""
BOUNDARY = (0.3, 0.7)
"""Expected failure rates that count as the boundary."""
POOL = 20_000
"""Number of random points among which the boundary is looked for."""


def boundary(dimensions: int, runs: int, seed: int, describe: Describe) -> Generator[Points, Sequence[float], None]:
    """Yield batches of points of the unit cube; send back their margins, below 0 for a failure."""
    rng = np.random.default_rng(seed)
    coarse = round(COARSE_SHARE * runs / RUNS_PER_BATCH) * RUNS_PER_BATCH
    points: Points = list(qmc.LatinHypercube(dimensions, seed=rng).random(coarse))
    margins: list[float] = []
    for begin in range(0, coarse, RUNS_PER_BATCH):
        margins += yield points[begin : begin + RUNS_PER_BATCH]
    while len(points) < runs:
        pool = rng.random((POOL, dimensions))
        failed = np.array(margins) < 0
        risk = np.full(POOL, 0.5)
        if failed.any() and not failed.all():
            risk = fitted_forest(describe(points), failed, seed).predict_proba(describe(pool))[:, 1]
        within = np.flatnonzero((risk >= BOUNDARY[0]) & (risk <= BOUNDARY[1]))
        if len(within) < RUNS_PER_BATCH:
            within = np.argsort(np.abs(risk - 0.5), kind="stable")[:RUNS_PER_BATCH]
        chosen = list(pool[rng.choice(within, RUNS_PER_BATCH, replace=False)])
        points += chosen
        margins += yield chosen


def lifted(scenarios: Scenarios, draw: Generator[Points, Sequence[float], Any]) -> tuple[Floats, Any, Any]:
    """Return the points of all lifts of a way to draw, which of them dropped, and the answer of that way."""
    answered, answer = scenarios.answer(OBJECTS, draw, drop_margin, lambda done, asked: None, complete=completed)
    rows = list(chain.from_iterable(answered))
    return np.array([row["point"] for row in rows]), np.array([drop_margin(row) < 0 for row in rows]), answer


def ranked(described: Floats, dropped: Any, held_out: Floats, truth: Any, seed: int) -> dict[str, float]:
    """Return the AUC of each model on lifts that it was not fitted on."""
    if min(dropped.sum(), (~dropped).sum()) < 2:
        return {}
    shuffled = np.random.default_rng(seed).permutation(dropped)
    line = make_pipeline(StandardScaler(), LogisticRegression(max_iter=1000)).fit(described, dropped)
    votes = {
        "forest": fitted_forest(described, dropped, seed).predict_proba(held_out)[:, 1],
        "logistic": line.predict_proba(held_out)[:, 1],
        "shuffled": fitted_forest(described, shuffled, seed).predict_proba(held_out)[:, 1],
    }
    return {name: float(roc_auc_score(truth, each)) for name, each in votes.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name, usual in (("runs", 304), ("held-out", 600), ("repeats", 3), ("jobs", 2)):
        parser.add_argument(f"--{name}", type=int, default=usual)
    parser.add_argument("--out", default="")
    parser.add_argument("--json", type=Path)
    own = parser.parse_args()
    describe = NeededForce(OBJECTS, completed, QUICK)
    dimensions = len(OBJECTS)

    def used(budget: int, runs: int) -> float:
        return runs / budget

    ways: dict[str, Callable[[int], Generator[Points, Sequence[float], Any]]] = {
        "certificate": lambda seed: sequential(dimensions, partial(used, own.runs), seed, describe),
        "drawn evenly": lambda seed: plain(dimensions, partial(used, own.runs), seed, describe),
        "boundary search": lambda seed: boundary(dimensions, own.runs, seed, describe),
    }
    found: list[dict[str, Any]] = []
    limits = Limits(slip_m=USUAL_SLIP_MM * 1e-3, peak=None)
    with Scenarios(limits, QUICK, own.out, own.jobs, "") as scenarios:
        evenly = plain(dimensions, partial(used, own.held_out), FIRST - 1, describe)
        held_out, truth, count = lifted(scenarios, evenly)
        described = describe(held_out)
        trivial = float(roc_auc_score(truth, described[:, -1]))
        print(
            f"{len(truth)} lifts drawn evenly: {count.failed} dropped, {count.estimate:.1%} ({count.least:.1%} to "
            f"{count.most:.1%}); AUC of the needed force alone {trivial:.2f}",
            flush=True,
        )
        for repeat in range(own.repeats):
            for way, draw in ways.items():
                points, dropped, answer = lifted(scenarios, draw(FIRST + repeat))
                row = {"way": way, "repeat": repeat, "runs": len(points), "dropped": int(dropped.sum())}
                row |= {"auc": ranked(describe(points), dropped, described, truth, repeat)}
                if answer is not None:
                    row |= {key: getattr(answer, key) for key in ("estimate", "least", "most")}
                found.append(row)
                print(row, flush=True)
    if own.json:
        own.json.write_text(json.dumps({"held_out": count.failed, "trivial_auc": trivial, "rows": found}), "utf-8")


if __name__ == "__main__":
    main()
