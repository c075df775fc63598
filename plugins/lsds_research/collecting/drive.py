"""Run one trial on the cell of a config, as a job of the engine."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.config import load_config
from lsds.config.overrides import override_texts
from lsds.errors import DataError
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig
from lsds.session.recording import ENDING, recorder_of
from lsds.session.run import LAST_WRITES_S
from lsds_research.collecting.job import TrialJob

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from lsds.contracts import Cycle
    from lsds_research.collecting.trials import Trial


def run_trial(
    trial: Trial,
    config_file: str | None,
    overrides: Sequence[str],
    also: Callable[[Cycle], object] | None = None,
    record: Path | None = None,
) -> dict[str, NDArray[Any]]:
    """Return the columns of one recording; `also` is called with the cycle of each of its frames.

    `record` is a folder that gets a recording of the run, as of `lsds run --record`. Raises the errors of a rig and its
    engine, such as SafetyStop, and DataError without a settled image of the untouched gel, or if the recording of the
    run is not complete.
    """
    settings = {"seed": trial.seed, "cell.simulated.clamped": trial.clamped} | trial.simulated
    own = override_texts(settings)
    config = load_config(config_file, [*own, *overrides])
    with Rig(config) as rig, ExitStack() as ending:
        recorder = recorder_of(rig, None if record is None else new_file(record, trial.recording))
        rig.arm_devices()
        job = TrialJob(trial, measured=rig.pose_source is not None, also=also)
        engine = Engine(rig, job)
        engine.observers.add("rows", job.keep)
        if recorder is not None:
            engine.events.add("recording", recorder.observe, recorder.close)
            ending.callback(engine.events.close, LAST_WRITES_S)
        engine.run()
        if failure := engine.observers.statistics()[0].failure:
            raise DataError(f"{trial.recording}: a frame could not be recorded: {failure}")
        if recorder is not None:
            engine.events.close(LAST_WRITES_S)
            (written,) = engine.events.statistics()
            if written.failure or written.dropped:
                raise DataError(
                    f"{recorder.path}: {written.failure or f'{written.dropped} events were lost'} (free some space, "
                    "take a faster disk, or collect without --record)"
                )
        return job.columns()


def new_file(folder: Path, name: str) -> Path:
    """Return a file that does not exist yet: a trial that is repeated leaves its earlier recordings as they are."""
    path, number = folder / f"{name}{ENDING}", 1
    while path.exists():
        number += 1
        path = folder / f"{name}-{number}{ENDING}"
    return path
