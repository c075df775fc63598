"""Collect missing data, run all fits in parallel, and gather the rows."""

from __future__ import annotations

import hashlib
import inspect
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
from lsds.registry.host import PluginHost
from lsds.support.files import write_whole
from lsds.support.processes import DIED, spread
from lsds_research.collecting.campaign import collect, differing, study
from lsds_research.collecting.trials import STUDY
from lsds_research.datasets import CARD, read_card
from lsds_research.evaluation.fitting import Model
from lsds_research.reproduce.jobs import FitJob, planned, run

Tick = Callable[[str, int, int], None]
RESULTS, FITS = "results.json", "fits"


def measure(out: Path, *, seed: int = 0, quick: bool = False, jobs: int = 1, tick: Tick) -> dict[str, Any]:
    """Return {"rows", "failed", "datasets", ...}; data goes to `out`/data and fits go to `out`/fits. A second call
    reuses both, so an interrupted measurement continues.

    `tick(what, done, whole)` reports progress. Raises PluginError if a training library is missing, DataError if data
    cannot be collected or written. A learner that fails is listed in "failed", and all others are measured.
    """
    todo, host = planned(quick=quick), PluginHost()
    # Report a missing library before the long computation, not after it.
    learners = [Model(name, own=True).build(host) for name in sorted({job.learner for job in todo if job.learner})]
    code = _code([Path(__file__).parents[1], *(Path(inspect.getfile(type(learner))).parent for learner in learners)])
    data = out / "data"
    own = [out / RESULTS, out / FITS, *(data / name / CARD for name in STUDY)]
    if any(path.is_file() for path in out.rglob("*")) and not any(path.exists() for path in own):
        raise DataError(f"{out}: is not empty and not a reproduction; choose another --out")
    cards = {}
    for name in STUDY:
        folder = data / name
        card = read_card(folder) or {}
        if not card.get("complete"):
            collect(name, folder, seed=seed, quick=quick, jobs=jobs, tick=_named_tick(tick, f"collecting {name}"))
            card = read_card(folder) or {}
        other = differing(card, study(name, seed, quick=quick))
        if other:
            raise DataError(f"{folder}: was collected with another {other} (choose another --out)")
        cards[name] = card
    rows: list[dict[str, Any]] = []
    failed: list[dict[str, str]] = []
    fitting = partial(_kept, fits=out / FITS, code=code, data=str(data), seed=seed, quick=quick)
    for done, (job_done, found) in enumerate(spread(fitting, todo, jobs), 1):
        if found is None or isinstance(found, str):
            job_name = " ".join(str(v) for v in asdict(job_done).values() if v)
            failed.append({"job": job_name, "reason": found or DIED})
        else:
            rows += found
        tick("fitting", done, len(todo))
    result = {
        "figures_are": "simulated",
        "seed": seed,
        "quick": quick,
        "rows": rows,
        "failed": failed,
        "datasets": cards,
        "versions": {"lsds": __version__, "python": platform.python_version()},
    }
    write_whole(out / RESULTS, json.dumps(result, indent=1, default=float).encode())
    return result


def _code(folders: list[Path]) -> str:
    """Return a digest of the code that fits and scores."""
    files = sorted(path for folder in set(folders) for path in folder.rglob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


def _kept(job: FitJob, fits: Path, code: str, data: str, seed: int, quick: bool) -> list[dict[str, Any]] | str:
    """Return a fit's rows, cached if nothing that they depend on has changed."""
    cards = [(Path(data) / name / CARD).read_text(encoding="utf-8") for name in STUDY]
    content = json.dumps([asdict(job), cards, seed, quick, __version__, code], sort_keys=True)
    path = fits / f"{hashlib.sha256(content.encode()).hexdigest()[:24]}.json"
    try:
        rows: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))
        return rows
    except (OSError, ValueError):
        pass
    found = _guarded(job, data, seed, quick)
    if not isinstance(found, str):
        write_whole(path, json.dumps(found, default=float).encode())
    return found


def _guarded(job: FitJob, data: str, seed: int, quick: bool) -> list[dict[str, Any]] | str:
    begun = perf_ns()
    try:
        rows = run(job, data, seed, quick)
    except LsdsError as error:
        return str(error)
    except Exception as error:
        # Any exception of a training library ends only this fit; the others continue.
        return f"{type(error).__name__}: {error}"
    return [{**row, "seconds": (perf_ns() - begun) / 1e9} for row in rows]


def _named_tick(tick: Tick, what: str) -> Callable[[int, int, str], None]:
    return lambda done, whole, _: tick(what, done, whole)
