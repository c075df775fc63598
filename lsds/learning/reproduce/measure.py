"""Collect what is missing, fit everything over processes, gather the rows."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from lsds import __version__
from lsds.clock import perf_ns
from lsds.errors import DataError, LsdsError
from lsds.learning.collect.campaign import collect
from lsds.learning.collect.trials import JOBS
from lsds.learning.datasets import CARD, write_whole
from lsds.learning.evaluation.fitting import Model
from lsds.learning.reproduce.jobs import FitJob, planned, run
from lsds.plugins.host import PluginHost
from lsds.processes import DIED, spread

Tick = Callable[[str, int, int], None]
RESULTS = "results.json"


def measure(out: Path, *, seed: int = 0, quick: bool = False, jobs: int = 1, tick: Tick) -> dict[str, Any]:
    """Return {"rows", "failed", "datasets", ...}; data goes to `out`/data and is used again where it is complete.

    `tick(what, done, whole)` on the way. Raises PluginError where a training library is missing, DataError where data
    cannot be collected or written; a learner that fails is named in "failed", and all others are measured.
    """
    todo, host = planned(quick=quick), PluginHost()
    for learner in {job.learner for job in todo if job.learner}:
        Model(learner).build(host)  # A library that is missing is told before half an hour has passed.
    data = out / "data"
    cards = {}
    for name in JOBS:
        folder = data / name
        if not _complete(folder):
            collect(name, folder, seed=seed, quick=quick, jobs=jobs, tick=_told(tick, f"collecting {name}"))
        cards[name] = json.loads((folder / CARD).read_text(encoding="utf-8"))
        other = [key for key, own in (("seed", seed), ("quick", quick)) if cards[name].get(key, own) != own]
        if other:
            raise DataError(f"{folder}: was collected with another {' and '.join(other)} (choose another --out)")
    rows: list[dict[str, Any]] = []
    failed: list[dict[str, str]] = []
    fitting = partial(_guarded, data=str(data), seed=seed, quick=quick)
    for done, (job_done, found) in enumerate(spread(fitting, todo, jobs), 1):
        if found is None or isinstance(found, str):
            job_name = " ".join(str(v) for v in asdict(job_done).values() if v)
            failed.append({"job": job_name, "reason": found or DIED})
        else:
            rows += found
        tick("fitting", done, len(todo))
    result = {
        "figures_are": "simulated", "seed": seed, "quick": quick, "rows": rows, "failed": failed, "datasets": cards,
        "versions": {"lsds": __version__, "python": platform.python_version()},
    }  # fmt: skip
    write_whole(out / RESULTS, json.dumps(result, indent=1, default=float).encode())
    return result


def _guarded(job: FitJob, data: str, seed: int, quick: bool) -> list[dict[str, Any]] | str:
    begun = perf_ns()
    try:
        rows = run(job, data, seed, quick)
    except LsdsError as error:
        return str(error)
    except Exception as error:
        # A training library's own; the other fits go on.
        return f"{type(error).__name__}: {error}"
    return [{**row, "seconds": (perf_ns() - begun) / 1e9} for row in rows]


def _told(tick: Tick, what: str) -> Callable[[int, int, str], None]:
    return lambda done, whole, _: tick(what, done, whole)


def _complete(folder: Path) -> bool:
    try:
        known = json.loads((folder / CARD).read_text(encoding="utf-8"))
        if not isinstance(known, dict):
            raise ValueError("it holds no table")
        return bool(known.get("complete"))
    except FileNotFoundError:
        return False
    except (OSError, ValueError) as error:
        raise DataError(f"{folder / CARD}: not a dataset's card: {error}") from error
