"""Run one trial on the cell of a config, as a job of the engine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lsds.config import load_config
from lsds.config.overrides import override_texts
from lsds.errors import DataError
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig
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
) -> dict[str, NDArray[Any]]:
    """Return the columns of one recording; `also` is called with the cycle of each of its frames.

    Raises the errors of a rig and its engine, such as SafetyStop, and DataError without a settled image of the
    untouched gel.
    """
    settings = {"seed": trial.seed, "cell.simulated.clamped": trial.clamped} | trial.simulated
    own = override_texts(settings)
    config = load_config(config_file, [*own, *overrides])
    with Rig(config) as rig:
        rig.arm_devices()
        job = TrialJob(trial, measured=rig.pose_source is not None, also=also)
        engine = Engine(rig, job)
        engine.observers.add("rows", job.keep)
        engine.run()
        if failure := engine.observers.statistics()[0].failure:
            raise DataError(f"{trial.recording}: a frame could not be recorded: {failure}")
        return job.columns()
