"""Run all trials of a job in parallel, write each recording to disk when it is done, and merge them to one dataset.

A recording is a file in `parts`. Existing recordings are not repeated, so a campaign that was interrupted, or ran out
of disk space, can be continued.
"""

from __future__ import annotations

import hashlib
import json
import platform
import shutil
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from lsds import __version__
from lsds.config import RigConfig, load_config
from lsds.contracts import Kind
from lsds.errors import DataError, LsdsError, SafetyStop
from lsds.registry.backends import NO_DEVICE
from lsds.registry.host import PluginHost
from lsds.support.extras import require
from lsds.support.files import write_whole
from lsds.support.processes import DIED, spread
from lsds_research.collecting.drive import run_trial
from lsds_research.collecting.trials import Job, Trial, trials
from lsds_research.datasets import (
    CARD,
    COLUMNS,
    FORMAT,
    PARTS,
    Dataset,
    joined,
    read_card,
    read_table,
    require_arrow,
    write_table,
)

_GEL = (
    "safety.max_arm_angular_rad_s=3.0",
    # The slowest sensors have ten frames per second, and markers that jump are lost for a few frames.
    "safety.stale_after_s=1.0",
    "cell.simulated.fidelity=pad",
    "cell.simulated.grid=1",
    "cell.simulated.step_ms=4.0",
)
_CAMERA = (
    "pose_source.backend=lsds:mock-truth-camera",
    "pose_source.mock-truth-camera.width=320",
    "pose_source.mock-truth-camera.height=240",
)
PRESETS: dict[Job, tuple[str, ...]] = {
    "detection": _GEL,
    "severity": (*_GEL, *_CAMERA),
    "pipe": (*_GEL, *_CAMERA),
    "catch": _GEL,
    # It shakes sharply, on purpose.
    "loads": (*_GEL, "safety.max_arm_acceleration_m_s2=2.0"),
}
"""Overrides of the default, simulated cell: its gel is on the coarsest grid in steps of 4 ms.

For velocities the image of the pose camera is small, because rendering it takes most of the time.
"""


def collect(
    job: Job,
    out: Path,
    *,
    config_file: str | None = None,
    overrides: Sequence[str] = (),
    objects: Sequence[str] | None = None,
    seed: int = 0,
    quick: bool = False,
    jobs: int = 1,
    tick: Callable[[int, int, str], None] = lambda done, whole, name: None,
    prepare: Callable[[Trial], None] | None = None,
    record: Path | None = None,
) -> Dataset:
    """Collect the recordings of a job that are missing in a folder; `tick(done, whole, recording)` reports progress.

    On a real cell `prepare(trial)` returns when the object is in place. A real cell needs it. `record` is a folder in
    which each trial that is run leaves a recording, NAME.mcap; it changes nothing in the dataset.

    Raises DataError if the folder holds something else or cannot be written; if trials failed, after all others are
    done, with the name of each. All finished recordings are kept. A simulated trial that the safety guard stops would
    stop again, so the dataset omits it and its card lists it under `stopped`.
    """
    settings = (*(() if config_file else PRESETS[job]), *overrides)
    config = load_config(config_file, settings)
    planned = trials(job, objects, seed, quick=quick)
    asked = _asked(job, planned, config, settings, seed, quick)
    own = {"seed", "cell.simulated.clamped", *(key for trial in planned for key in trial.simulated)}
    taken = sorted(own & {override.partition("=")[0].strip() for override in overrides})
    if taken:
        raise DataError(f"{', '.join(taken)}: is set by the protocol in each trial; use --seed to draw other values")
    require_arrow()
    if record is not None:
        _prepare_recordings(record)
    begun = _is_begun(out, asked)
    parts = out / PARTS
    missing = [trial for trial in planned if not _is_whole(_part(parts, trial))]
    mocked = config.cell.backend != NO_DEVICE
    if missing and not mocked and prepare is None:
        raise DataError("on a real cell an operator must place each object; run the command in a terminal")
    for trial in missing:
        _set_aside(_part(parts, trial))
    if not begun:
        card = {**asked, "format": FORMAT, "complete": False}
        write_whole(out / CARD, json.dumps(card, indent=2, sort_keys=True).encode())
    done = len(planned) - len(missing)
    tick(done, len(planned), "")
    failed: list[str] = []
    stopped: dict[str, str] = {}
    virtual = _has_virtual_time(config)
    work = partial(_do, parts=parts, config_file=config_file, settings=settings, record=record)
    if prepare is not None and not mocked:
        work = partial(_do_by_hand, prepare=prepare, work=work)
    # A cell that runs in real time exists once, so only one process can use it.
    for trial, problem in spread(work, missing, jobs if virtual else 1):
        done += 1
        if isinstance(problem, Stopped) and virtual:
            stopped[trial.recording] = problem
        elif problem != "":
            failed.append(f"{trial.recording}: {problem or DIED}")
        tick(done, len(planned), trial.recording)
    if failed:
        shown = "\n  ".join(failed[:5]) + (f"\n  and {len(failed) - 5} more" if len(failed) > 5 else "")
        raise DataError(
            f"{out}: {len(failed)} of {len(planned)} recordings failed (run it again to repeat them)\n  {shown}"
        )
    planned = [trial for trial in planned if trial.recording not in stopped]
    if not planned:
        raise DataError(f"{out}: the safety guard stopped every recording; the first: {next(iter(stopped.values()))}")
    card = asked | _made_with(mocked) | ({"stopped": stopped} if stopped else {})
    data = joined([_read_part(_part(parts, trial)) for trial in planned], card)
    if mocked:
        gels = sorted({int(trial.simulated["sensor.mock-gelsight-mini.gel"]) for trial in planned})
        data = Dataset(data.columns, {**data.card, "gels": gels})
    data.save(out)
    shutil.rmtree(parts, ignore_errors=True)
    return data


def study(job: Job, seed: int, *, quick: bool) -> dict[str, Any]:
    """Return the card of the default dataset: the simulated cell, all objects."""
    settings = PRESETS[job]
    return _asked(job, trials(job, None, seed, quick=quick), load_config(None, settings), settings, seed, quick)


def _asked(
    job: Job, planned: Sequence[Trial], config: RigConfig, settings: Sequence[str], seed: int, quick: bool
) -> dict[str, Any]:
    """Return the settings that determine the data."""
    return {
        "job": job,
        "seed": seed,
        "quick": quick,
        "objects": sorted({trial.object for trial in planned}),
        "labels": "truth, smoothed" if config.pose_source.backend == NO_DEVICE else "poses, smoothed",
        "rig": _rig(config),
        "overrides": list(settings),
        "lsds": __version__,
        "config": _digest(config),
    }


class Stopped(str):
    """Why the safety guard stopped a trial."""

    __slots__ = ()


def _prepare_recordings(folder: Path) -> None:
    """Create the folder of recordings. Raises MissingExtra, DataError."""
    require("mcap", "foxglove_schemas_protobuf", "orjson", extra="record", purpose="a recording")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(
            f"{folder}: the recordings cannot be written: {error.strerror} (choose another folder)"
        ) from error


def _do(trial: Trial, parts: Path, config_file: str | None, settings: Sequence[str], record: Path | None = None) -> str:
    """Run a trial and save it; return its error text. Raises DataError if it cannot be saved."""
    try:
        columns = run_trial(trial, config_file, settings, record=record)
    except SafetyStop as error:
        return Stopped(error)
    except LsdsError as error:
        return str(error)
    except Exception as error:
        # Any exception of a library ends only this trial; the others continue.
        return f"{type(error).__name__}: {error}"
    write_table(columns, _part(parts, trial))
    return ""


def _do_by_hand(trial: Trial, prepare: Callable[[Trial], None], work: Callable[[Trial], str]) -> str:
    prepare(trial)
    return work(trial)


def differing(card: Mapping[str, Any], asked: dict[str, Any]) -> str:
    """Return the names of the settings in which a dataset's card differs from the requested ones; empty if they are
    equal."""
    requested = json.loads(json.dumps(asked))
    own = {key: card.get(key) for key in requested if card.get(key) != requested[key]}
    return ", ".join(f"{key} ({own[key]})" if key in ("seed", "quick", "labels", "lsds") else key for key in own)


def _is_begun(out: Path, asked: dict[str, Any]) -> bool:
    """Return whether the folder holds a part of this campaign. Raises DataError if it holds anything else."""
    known = read_card(out)
    if known is None or known.get("format") != FORMAT:
        if out.exists() and any(out.iterdir()):
            raise DataError(f"{out}: is not empty and not a dataset; choose another folder")
        return False
    other = differing(known, asked)
    if known.get("complete"):
        content = (
            f"a complete dataset with another {other}" if other else "this dataset, complete: nothing is left to do"
        )
        raise DataError(f"{out}: holds {content} (choose another folder for a new dataset)")
    if other:
        raise DataError(
            f"{out}: was started with another {other}; repeat the same settings to continue, or choose another folder"
        )
    return True


def _part(parts: Path, trial: Trial) -> Path:
    return parts / f"{trial.recording}.parquet"


def _is_whole(path: Path) -> bool:
    """Return whether a recording exists and can be read."""
    if not path.is_file():
        return False
    try:
        _read_part(path)
    except DataError:
        return False
    return True


def _set_aside(path: Path) -> None:
    """Move a damaged recording aside; it is recorded again."""
    if path.is_file():
        path.replace(path.with_suffix(".damaged"))


def _read_part(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    columns = read_table(path)
    missing = [name for name in COLUMNS if name not in columns]
    if missing:
        raise DataError(f"{path}: column {', '.join(missing)} missing; run it again")
    return columns


def _rig(config: RigConfig) -> dict[str, str]:
    kinds: tuple[Kind, ...] = ("sensor", "gripper", "arm", "pose_source", "cell", "tracker")
    return {kind: config.section(kind).backend for kind in kinds}


def _digest(config: RigConfig) -> str:
    """Return a number that changes with anything in the config."""
    return hashlib.sha256(config.model_dump_json().encode()).hexdigest()[:16]


def _has_virtual_time(config: RigConfig) -> bool:
    host = PluginHost()
    kinds: tuple[Kind, ...] = ("sensor", "gripper", "arm")
    return all(host.find(kind, config.section(kind).backend).spec.virtual_time for kind in kinds)


def _made_with(simulated: bool) -> dict[str, Any]:
    installed = {name: _version(name) for name in ("numpy", "opencv-python-headless", "numba")}
    return {
        "figures_are": "simulated" if simulated else "measured",
        "versions": {"lsds": __version__, "python": platform.python_version(), **installed},
    }


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "not installed"
