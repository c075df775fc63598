"""Study `search`: the loop of search, run, shrink and save."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from lsds.cli.output import require_writable_folder
from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult
from lsds.errors import LsdsError
from lsds.registry.containment import one_line
from lsds.session.run import run
from lsds.support.extras import importable
from lsds.support.processes import DIED, spread
from lsds_research.campaign_options import quickened
from lsds_research.search.files import save_scenario
from lsds_research.search.fixed_keys import held_fixed
from lsds_research.search.objects import chosen_space
from lsds_research.search.options import SearchOptions
from lsds_research.search.plot import plot_search
from lsds_research.search.robustness import NOT_RUN, Limits, run_warnings
from lsds_research.search.scenarios import Scenarios, not_holdable, require_usable, undrawn_notes
from lsds_research.search.seek import seek
from lsds_research.search.shrink import shrunk
from lsds_research.search.space import Scenario, point_to_scenario

_COLUMNS = (
    ("failure", "failure", ""),
    ("margin", "margin", ".2f"),
    ("keys", "keys that matter", ""),
    ("sentence", "verdict", ""),
    ("file", "file", ""),
)
SHRINKS = 48
"""Maximum number of runs to shrink one failure."""
ATTEMPTS = 3
"""Number of failures that are shrunk for each one that is wanted; chosen."""


QUICK = {"runs": 48, "most": 1}
"""Options of `--quick`, unless they are given."""


class SearchStudy:
    """A `Study`."""

    def __init__(self, options: SearchOptions, context: BuildContext) -> None:
        self._options, self._seed = options, context.seed
        few = quickened(options, QUICK)
        self._runs, self._most = few.runs, few.most
        self._space, self._firm, self._complete = chosen_space(options.space, random=options.random)
        self._limits = Limits(options.slip_mm * 1e-3, options.peak)
        self._settings = tuple(options.settings)
        self._space, self._fixed = held_fixed(self._space, self._settings)

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Search, shrink, save. Raises DataError for an unusable space or folder, MissingExtra."""
        options = self._options
        idle = require_usable(self._space, self._complete, self._limits, self._settings, options.space)
        if options.found:
            require_writable_folder(Path(options.found))
        batches = seek(len(self._space), self._runs, self._seed)
        with Scenarios(
            self._limits, self._settings, options.out, options.jobs, options.cluster, self._firm
        ) as self._scenarios:
            answered, _ = self._scenarios.answer(
                self._space, batches, itemgetter("margin"), lambda done, _: tick(done, self._runs), self._complete
            )
            rows = list(chain.from_iterable(answered))
            found = self._found(rows)
        failed = [row for row in rows if row["margin"] < 0]
        stopped = Counter(
            row["fault"].split(":")[0]
            for row in rows
            if row["fault"] and row["margin"] >= 0 and row["outcome"] != NOT_RUN
        )
        notes = [
            f"{len(failed)} of {len(rows)} scenarios failed; {sum(stopped.values())} were stopped by an "
            "expected error; margin: 1 is best, below 0 a failure",
            *not_holdable(rows),
            *undrawn_notes(self._fixed, idle),
        ]
        return StudyResult(
            f"search over {len(self._space) - len(self._fixed)} config keys, {len(rows)} scenarios (simulated)",
            _COLUMNS,
            found,
            partial(plot_search, rows=rows, keys=[axis.key for axis in self._space]),
            notes,
            {
                "runs": rows,
                "found": found,
                "simulated_s": float(np.sum([row["simulated_s"] for row in rows])),
                "stopped": dict(stopped),
                "figures_are": "simulated",
                "seed": self._seed,
            },
            warnings=run_warnings(rows, most=1.0),
        )

    def _found(self, rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
        """Shrink the worst failures of each way to fail; save them if a folder is given."""
        failed = sorted(
            (row for row in rows if row["margin"] < 0), key=lambda row: (row["margin"], str(row["scenario"]))
        )
        ways: Counter[str] = Counter()
        settings = (*self._limits.overrides(), *self._settings)
        found: list[dict[str, Any]] = []
        seen: set[str] = set()
        # Failures with one cause shrink to the same scenario, and each costs many runs.
        for row in failed[: ATTEMPTS * self._most]:
            if len(found) >= self._most:
                break
            # The drawn keys are shrunk: without some of them, keys that were derived from them would no longer fit.
            drawn = point_to_scenario(self._space, row["point"])
            small = self._complete(shrunk(drawn, self._space, partial(self._fails, row["way"]), SHRINKS))
            keys = ", ".join(f"{key.rpartition('.')[2]} = {value}" for key, value in small.items())
            if keys in seen:
                continue
            seen.add(keys)
            ways[row["way"]] += 1
            name = f"{row['way'].replace(' ', '-')}-{ways[row['way']]}"
            (failed_row,) = self._scenarios.rows([small], lambda _: None)
            margin, sentence = failed_row["margin"], failed_row.get("sentence", failed_row["outcome"])
            comment = [f"fails: {row['way']} (margin {margin:.2f}); found by lsds study search, shrunk", sentence]
            file = ""
            if self._options.found:
                file = str(self._saved(name, small, settings, comment))
            shown = {"keys": keys or "none: the default", "sentence": sentence, "file": file}
            found.append({"failure": row["way"], "margin": margin, **shown})
        return found

    def _saved(self, name: str, scenario: Scenario, settings: tuple[str, ...], comments: list[str]) -> Path:
        """Save a failure as a file that lsds run repeats, next to a recording of it; return the file."""
        folder = Path(self._options.found or "")
        if not importable("mcap"):
            return save_scenario(folder, name, scenario, settings, comments)
        recording = folder / f"{name}.mcap"
        comments = [*comments, f"recording: {recording.name} (lsds replay, lsds record report)"]
        file = save_scenario(folder, name, scenario, settings, comments)
        # A failure that was found before is recorded again by the present code.
        recording.unlink(missing_ok=True)
        # In another process, which the failure may kill.
        ((_, problem),) = spread(_record, [(str(file), str(recording))], 2)
        if problem is None or problem:
            note = f"not recorded to its end: {one_line(problem or DIED)}"
            return save_scenario(folder, name, scenario, settings, [*comments[:-1], note])
        return file

    def _fails(self, way: str, scenario: Scenario) -> bool:
        row = self._scenarios.rows([self._complete(scenario)], lambda _: None)[0]
        return bool(row["margins"].get(way, 1.0) < 0)


def _record(files: tuple[str, str]) -> str:
    """Run a saved failure and record it; return the error that ended it, or ""."""
    file, recording = files
    try:
        run(file, record=recording, images="jpeg").require_uninterrupted()
    except LsdsError as error:
        return f"{type(error).__name__}: {error}"
    return ""
