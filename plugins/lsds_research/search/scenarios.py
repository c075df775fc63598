"""Runs scenarios, each once: over processes or a cluster, and from a file of those that were run before."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from lsds_research.cluster import shared_out
from lsds_research.kept import keep, read_kept
from lsds_research.search.robustness import Limits, least, run_scenario
from lsds_research.search.space import Scenario


class Scenarios:
    """Scenarios that were run with some more config keys, the `settings`, by what they are."""

    def __init__(self, limits: Limits, settings: Sequence[str], out: str, jobs: int, cluster: str) -> None:
        """Raises DataError where the file `out` cannot be read; an empty one keeps nothing."""
        self._limits, self._settings = limits, tuple(settings)
        self._jobs, self._cluster = jobs, cluster
        self._kept = Path(out) if out else None
        self._known = read_kept(self._kept)

    def rows(self, scenarios: Sequence[Scenario], done: Callable[[int], None]) -> list[dict[str, Any]]:
        """Return the rows of scenarios, in their order; those that are kept are not run again."""
        keys = [self._key(scenario) for scenario in scenarios]
        missing = {key: s for key, s in zip(keys, scenarios, strict=True) if key not in self._known}
        asked = [(scenario, self._limits, self._settings) for scenario in missing.values()]
        shared = shared_out(run_scenario, asked, self._jobs, self._cluster)
        for count, ((scenario, _, _), result) in enumerate(shared, start=len(scenarios) - len(missing) + 1):
            # A process that died took the scenario with it: that is a failure without a name.
            told = result or {"margins": {"named": -1.0}, "outcome": "died", "fault": "the process died"}
            way, margin = least(told["margins"])
            row = {"scenario": scenario, "way": way, "margin": margin, "simulated_s": 0.0} | told
            self._known[self._key(scenario)] = row
            keep(self._kept, self._key(scenario), row)
            done(count)
        return [self._known[key] for key in keys]

    def _key(self, scenario: Scenario) -> str:
        return json.dumps([scenario, self._limits.slip_m, self._limits.peak, self._settings])
