"""The first run on a machine compiles the solver, which takes a while: whoever waits should know for what."""

from __future__ import annotations

import sys
from pathlib import Path

from lsds_mocks.gel.field.sweep import relax


def announce() -> None:
    """Say on stderr that the solver has to be compiled, where that has not been done and kept yet."""
    if not any(Path(relax.stats.cache_path).glob("sweep.relax-*.nbi")):
        print("compiling the simulated gel, once on this machine: some 15 s", file=sys.stderr, flush=True)
