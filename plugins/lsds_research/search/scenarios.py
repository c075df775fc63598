"""Runs each scenario once, on processes or a cluster, and reuses the runs in a file."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeVar

from lsds.config import load_config
from lsds.config.overrides import override_texts
from lsds.errors import ConfigError
from lsds.registry import PluginHost
from lsds_research.cluster import Share, sharing
from lsds_research.idle_keys import idle_keys, require_objects
from lsds_research.job_of_a_run import require_lift
from lsds_research.named_files import files_of_settings
from lsds_research.run_store import add_run, read_runs
from lsds_research.search.robustness import NOT_RUN, Limits, least, run_scenario
from lsds_research.search.space import Axis, Scenario, point_to_scenario

if TYPE_CHECKING:
    from lsds_research.search.seek import Points

T = TypeVar("T")
_Asked = tuple[dict[str, Any], Limits, tuple[str, ...]]
"""Scenario, limits and more config keys of a run."""

DIED = "died"
"""Outcome of a scenario whose process ended."""
NOT_HOLDABLE = "no firm grip holds it"
"""Outcome of a scenario that fails, and with a firm grip as well."""


def _unbounded(_: int) -> int:
    return sys.maxsize


class Scenarios:
    """The runs of scenarios with common `settings` (config keys), by key.

    `firm` are the config keys of lifts with a firm grip. A scenario that fails is repeated with each; if all of them
    lose the object, it counts as no failure. Processes, or the connection to a cluster, are kept until the end of the
    `with` statement.
    """

    def __init__(
        self,
        limits: Limits,
        settings: Sequence[str],
        out: str,
        jobs: int,
        cluster: str,
        firm: Sequence[tuple[str, ...]] = (),
    ) -> None:
        """Raises DataError if the file `out` cannot be read; an empty name stores nothing."""
        self._limits, self._settings, self._firm = limits, tuple(settings), firm
        self._files = files_of_settings(self._settings)
        self._sharing, self._opened = partial(sharing, jobs, cluster), ExitStack()
        self._share: Share | None = None
        self._kept = Path(out) if out else None
        self._known = read_runs(self._kept)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._share = None
        self._opened.close()

    def _shared_out(self, items: Sequence[_Asked]) -> Iterator[tuple[_Asked, dict[str, Any] | None]]:
        """Yield what was asked with what came of it; a cluster is joined when there is something to ask."""
        if items and self._share is None:
            self._share = self._opened.enter_context(self._sharing())
        return iter(()) if self._share is None else self._share(run_scenario, items)

    def rows(self, scenarios: Sequence[Scenario], done: Callable[[int], None]) -> list[dict[str, Any]]:
        """Return the rows of scenarios, in their order; stored ones are not run again."""
        keys = [self._key(scenario) for scenario in scenarios]
        missing = {key: s for key, s in zip(keys, scenarios, strict=True) if key not in self._known}
        asked = [(scenario, self._limits, self._settings) for scenario in missing.values()]
        lost: list[dict[str, Any]] = []
        shared = self._shared_out(asked)
        for count, ((scenario, _, _), result) in enumerate(shared, start=len(scenarios) - len(missing) + 1):
            # A process that died is an unexpected failure.
            outcome = result or {"margins": {"named": -1.0}, "outcome": DIED, "fault": "the process died"}
            way, margin = least(outcome["margins"])
            row = {"scenario": scenario, "way": way, "margin": margin, "simulated_s": 0.0} | outcome
            if self._firm and _is_lost(row):
                lost.append(row)
            else:
                self._add(row)
            done(count)
        if lost:
            self._excuse(lost)
        return [self._known[key] for key in keys]

    def _add(self, row: dict[str, Any]) -> None:
        key = self._key(row["scenario"])
        self._known[key] = row
        # A resumed study runs again those that could not run.
        if row["outcome"] not in (DIED, NOT_RUN):
            add_run(self._kept, key, row)

    def _excuse(self, lost: Sequence[dict[str, Any]]) -> None:
        """Repeat scenarios that failed with firm grips, and add them; what all of these lose counts as no failure."""
        firm = [(row["scenario"], self._limits, (*self._settings, *grip)) for row in lost for grip in self._firm]
        dropped: Counter[str] = Counter()
        for (scenario, _, _), result in self._shared_out(firm):
            # A lift that did not run to its end says nothing about the object.
            dropped[self._key(scenario)] += result is not None and result["margins"].get("holds", 1.0) < 0
        for row in lost:
            excused = dropped[self._key(row["scenario"])] == len(self._firm)
            self._add(row | {"margins": {}, "margin": 1.0, "outcome": NOT_HOLDABLE} if excused else row)

    def answer(
        self,
        space: Sequence[Axis],
        batches: Generator[Points, Sequence[float], T],
        margin: Callable[[dict[str, Any]], float],
        tick: Callable[[int, int], None],
        complete: Callable[[Scenario], Scenario] = dict,
        room: Callable[[int], int] = _unbounded,
    ) -> tuple[list[list[dict[str, Any]]], T]:
        """Run the requested scenarios batch by batch and send back the margins; return the rows and the final answer.

        `tick` is called with the numbers of runs done and requested so far; `complete` adds keys that depend on others.
        A row has its `point` of the unit cube. `room` returns how many runs there is room for after a number of runs:
        a batch is run in parts of that size, and answered in part if there is no more room. Runs that have begun are
        awaited, so that quick ones are not preferred.
        """
        found: list[list[dict[str, Any]]] = []
        count = 0
        batch = next(batches)
        while True:
            rows: list[dict[str, Any]] = []
            while len(rows) < len(batch):
                # At least one run answers each batch.
                size = room(count) if rows else max(room(count), 1)
                if size <= 0:
                    break
                part = batch[len(rows) : len(rows) + size]
                asked = [complete(point_to_scenario(space, point)) for point in part]
                ran = self.rows(asked, partial(_ahead, tick, count, count + len(asked)))
                rows += [row | {"point": [float(u) for u in point]} for row, point in zip(ran, part, strict=True)]
                count += len(ran)
            found.append(rows)
            try:
                batch = batches.send([margin(row) for row in rows])
            except StopIteration as end:
                return found, end.value

    def _key(self, scenario: Scenario) -> str:
        firm = [self._firm] if self._firm else []
        files = [self._files] if self._files else []
        return json.dumps([scenario, self._limits.slip_m, self._limits.peak, self._settings, *firm, *files])


def require_usable(
    space: Sequence[Axis],
    complete: Callable[[Scenario], Scenario],
    limits: Limits,
    settings: Sequence[str],
    source: str,
) -> dict[str, str]:
    """Check the config in the middle of the space, and at both ends of each axis, before scenarios are run. Raises
    ConfigError, which names the file `source` of the space, "" for none; also if the objects have no effect.

    A scenario that cannot run fails in nothing: a mistake in the config would give a perfect result. Returns the other
    keys that have no effect, with the backend that is used instead of theirs.
    """
    host = PluginHost()
    idle: dict[str, str] = {}
    middle = [0.5] * len(space)
    places = [middle, *([*middle[:k], end, *middle[k + 1 :]] for k in range(len(space)) for end in (0.0, 1.0))]
    for place in places:
        scenario = complete(point_to_scenario(space, place))
        try:
            config = load_config(None, [*override_texts(scenario), *limits.overrides(), *settings], host=host)
            require_objects(config, scenario)
            require_lift(config)
        except ConfigError as error:
            raise ConfigError(f"{source or 'the default ranges'} with the settings", error.issues) from error
        idle |= idle_keys(config, scenario)
    return idle


def undrawn_notes(fixed: Sequence[str], idle: Mapping[str, str]) -> list[str]:
    """Return notes on the keys of the space that the settings hold fixed, or that have no effect, if there are some."""
    held = f"not drawn, because the settings hold them fixed: {', '.join(fixed)}"
    without = f"drawn without effect, because another backend is used: {', '.join(idle)}"
    return [*([held] if fixed else []), *([without] if idle else [])]


def not_holdable(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Return a note on the scenarios whose object no firm grip holds, if there are some."""
    count = sum(row["outcome"] == NOT_HOLDABLE for row in rows)
    return [f"in {count} of {len(rows)} no firm grip holds the object either; they count as held"] if count else []


def _is_lost(row: dict[str, Any]) -> bool:
    """Return whether a lift ran to its end and failed: a crash or a hang is no matter of the object."""
    return bool(row["margin"] < 0 and "holds" in row["margins"] and row["margins"].get("ends", 1.0) > 0)


def _ahead(tick: Callable[[int, int], None], before: int, asked: int, done: int) -> None:
    tick(before + done, asked)
