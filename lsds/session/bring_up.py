"""`lsds.bring_up`, for notebooks and programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from lsds.config import RigConfig
from lsds.contracts import Job
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig, require_moments
from lsds.session.parts import loaded
from lsds.support.blas import one_blas_thread


@contextmanager
def bring_up(
    config: RigConfig | str | Path | None = None, overrides: str | Sequence[str] = (), *, job: Job | None = None
) -> Iterator[Engine]:
    """Connect and arm a rig and return the engine that runs it; at the end, stop and close everything.

        with lsds.bring_up("rig.toml") as engine:
            for cycle in engine:
                print(cycle.stage, cycle.estimate.speed_m_s)

    `config` is a configuration or its file, None for the simulated cell; `overrides` change its keys. `job`
    replaces the job of the config. The engine's rig is `engine.rig`.
    """
    chosen = loaded(config, overrides)
    rig = Rig(chosen)
    require_moments(rig, job)
    with one_blas_thread(), rig:
        rig.arm_devices()
        yield Engine(rig, job)
