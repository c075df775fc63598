"""The search: a Sobol sequence over the whole space, then CMA-ES from the worst points, each at a distance from the
last."""

from __future__ import annotations

from collections.abc import Generator, Sequence

import numpy as np
from numpy.typing import NDArray

from lsds.support.extras import require

Points = list[NDArray[np.float64]]

START_SHARE = 0.5
"""Share of the runs in the initial Sobol sequence."""
SIGMA = 0.15
"""Initial step of CMA-ES in the unit cube."""
POPULATION = 8
"""Number of scenarios in a generation of CMA-ES; chosen."""
GENERATIONS = 6
"""Number of generations without a worse scenario that ends a descent."""
START_DISTANCE = 0.35
"""Minimum distance between the starts of descents, as a mean per dimension."""


def seek(dimensions: int, runs: int, seed: int) -> Generator[Points, Sequence[float], None]:
    """Yield batches of points of the unit cube; send back their margins. Ends after `runs` points.

    The batches depend on seed and margins only, not on the machine. Raises MissingExtra without scipy and cma.
    """
    for library in ("scipy", "cma"):
        require(library, extra="search", purpose="a search")
    from scipy.stats import qmc

    sobol = qmc.Sobol(dimensions, seed=seed)  # pyright: ignore[reportCallIssue]
    count = max(POPULATION, 2 ** int(np.log2(max(START_SHARE * runs, 2))))
    known: list[tuple[float, NDArray[np.float64]]] = []
    start = [np.asarray(point) for point in sobol.random(count)][:runs]
    for at in range(0, len(start), 2 * POPULATION):
        batch = start[at : at + 2 * POPULATION]
        known += zip((yield batch), batch, strict=True)
    begun: Points = []
    while len(known) < runs:
        first = _next_start(known, begun)
        begun.append(first)
        yield from _descend(first, known, runs, seed + len(begun))


def _next_start(known: Sequence[tuple[float, NDArray[np.float64]]], begun: Points) -> NDArray[np.float64]:
    """Return the worst point that is far from every start of a descent."""
    ranked = sorted(known, key=lambda item: item[0])
    for _, point in ranked:
        if all(float(np.mean(np.abs(point - other))) > START_DISTANCE / 2 for other in begun):
            return point
    return ranked[len(begun) % len(ranked)][1]


def _descend(
    first: NDArray[np.float64], known: list[tuple[float, NDArray[np.float64]]], runs: int, seed: int
) -> Generator[Points, Sequence[float], None]:
    import cma

    strategy = cma.CMAEvolutionStrategy(
        first, SIGMA, {"bounds": [0, 1], "popsize": POPULATION, "seed": seed + 1, "verbose": -9}
    )
    worst, since = float("inf"), 0
    while len(known) < runs and since < GENERATIONS and not strategy.stop():
        asked = [np.asarray(point) for point in strategy.ask()]
        margins = list((yield asked[: runs - len(known)]))
        known += zip(margins, asked, strict=False)
        if len(margins) < len(asked):
            return
        strategy.tell(asked, margins)
        since = 0 if min(margins) < worst - 1e-3 else since + 1
        worst = min(worst, *margins)
