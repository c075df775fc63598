"""A short recorded run of the simulated cell, made once."""

from __future__ import annotations

import pytest

from lsds.session.run import run

pytest.importorskip("mcap", reason="recordings need the extra record")

SHORT = ["task.lift_s=0.6", "task.hold_s=0.2", "task.settle_s=0.3", "seed=5"]
TWO_FINGERS = [
    "sensors.left.backend=mock-gelsight-mini",
    "sensors.right.backend=mock-gelsight-mini",
    "sensors.right.mock-gelsight-mini.gel=4",
]


@pytest.fixture(scope="session")
def recorded(tmp_path_factory):
    """The file, and the session of the run."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    return path, run(None, SHORT, record=path)
