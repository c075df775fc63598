"""Study `risk`: the probability of a failure, with bounds."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import asdict
from functools import partial
from itertools import chain
from typing import Any

import numpy as np

from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult
from lsds_research.campaign_options import quickened
from lsds_research.search.fixed_keys import held_fixed
from lsds_research.search.objects import chosen_space
from lsds_research.search.risk_options import RiskOptions
from lsds_research.search.risk_plot import plot_risk
from lsds_research.search.robustness import NOT_RUN, Limits, run_warnings
from lsds_research.search.scenarios import Scenarios, not_holdable, require_usable, undrawn_notes
from lsds_research.search.split import Points, Probability, counted, split

_COLUMNS = (
    ("failure", "failure", ""),
    ("runs", "runs", "d"),
    ("failed", "failed", "d"),
    ("estimate", "probability", ".2g"),
    ("least", "at least (95 %)", ".2g"),
    ("most", "at most (95 %)", ".2g"),
)
_WAYS = {"drop": ("holds", "slips little", "ends"), "slip": ("slips little", "holds", "ends")}
_RUNS_AT_ONCE = 16
"""Number of runs in a batch when counting; chosen."""


QUICK_SCENARIOS = 20
"""Number of scenarios of `--quick`, unless `--runs` is given."""


class RiskStudy:
    """A `Study`."""

    def __init__(self, options: RiskOptions, context: BuildContext) -> None:
        self._options, self._seed = options, context.seed
        self._runs = quickened(options, {"runs": QUICK_SCENARIOS}).runs
        self._plain = options.plain or options.quick
        self._space, self._firm, self._complete = chosen_space(options.space, random=options.random)
        self._limits = Limits(options.slip_mm * 1e-3, options.peak)

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Run the scenarios. Raises DataError for an unusable space or file, MissingExtra."""
        own = self._options
        space, fixed = held_fixed(self._space, own.settings)
        idle = require_usable(space, self._complete, self._limits, own.settings, own.space)
        draw = _counting if self._plain else split
        with Scenarios(self._limits, own.settings, own.out, own.jobs, own.cluster, self._firm) as scenarios:
            answered, probability = scenarios.answer(
                space,
                draw(len(space), self._runs, self._seed),
                self._margin,
                lambda done, asked: tick(done, max(self._runs, asked)),
                self._complete,
            )
        rows = list(chain.from_iterable(answered))
        margins = [[self._margin(row) for row in batch] for batch in answered]
        row = {"failure": own.failure, "runs": len(rows), "failed": probability.failed} | {
            key: value for key, value in asdict(probability).items() if key in ("estimate", "least", "most")
        }
        stopped = sum(
            row["margins"].get("named", 1.0) >= 0 and row["fault"] is not None and row["outcome"] != NOT_RUN
            for row in rows
        )
        method = "plain counting" if self._plain else f"splitting over {len(probability.levels)} levels"
        notes = [
            f"{method}; {stopped} runs were stopped by an expected error, which is not a failure",
            *not_holdable(rows),
            *undrawn_notes(fixed, idle),
        ]
        if not probability.estimate and probability.levels:
            notes.append("none failed on the last level: the probability is below the bound")
        return StudyResult(
            f"probability of a failure over {len(space) - len(fixed)} config keys (simulated)",
            _COLUMNS,
            [row],
            partial(plot_risk, margins=margins, limits=probability.levels),
            notes,
            {
                "probability": asdict(probability),
                "runs": rows,
                "simulated_s": float(np.sum([one["simulated_s"] for one in rows])),
                "figures_are": "simulated",
                "seed": self._seed,
            },
            warnings=run_warnings(rows),
        )

    def _margin(self, row: dict[str, Any]) -> float:
        margins = row["margins"]
        ways = _WAYS.get(self._options.failure, tuple(margins))
        return float(min((margins[way] for way in (*ways, "named") if way in margins), default=1.0))


def _counting(dimensions: int, runs: int, seed: int) -> Generator[Points, Sequence[float], Probability]:
    """Yield uniform points in batches; return the probability by counting."""
    rng, failed = np.random.default_rng(seed), 0
    for begin in range(0, runs, _RUNS_AT_ONCE):
        margins = yield list(rng.random((min(_RUNS_AT_ONCE, runs - begin), dimensions)))
        failed += sum(margin < 0 for margin in margins)
    return counted(failed, runs)
