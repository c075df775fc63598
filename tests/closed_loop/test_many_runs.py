"""Many runs in one process: each is freed with its last reference, and memory kept between them is bounded."""

from __future__ import annotations

import gc
import subprocess
import sys
import weakref

import pytest

import lsds

pytestmark = pytest.mark.usefixtures("installed_host")
SHORT = ("task.lift_s=0.3", "task.hold_s=0.2")
BOTH = (
    "sensors.left.backend=mock-gelsight-mini",
    "sensors.right.backend=mock-gelsight-mini",
    "sensors.right.mock-gelsight-mini.finger=right",
)
#: Prints the resident bytes after some of the runs, each of another object, gel and seed.
PROGRAM = """
import os, sys
from itertools import cycle
from pathlib import Path
import lsds
from lsds_mocks import byte_cache
from lsds_mocks.objects.catalogue import CATALOGUE

runs, budget, *looks = map(int, sys.argv[1:])
byte_cache.SHARED = byte_cache.ByteCache(budget or byte_cache.BUDGET_BYTES)
for run, name in zip(range(1, runs + 1), cycle(CATALOGUE)):
    own = [f"cell.simulated.object={name}", f"sensor.mock-gelsight-mini.gel={run}", f"seed={run}"]
    lsds.run(overrides=[*own, "task.lift_s=0.3", "task.hold_s=0.2"])
    if run in looks:
        print(int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE"))
"""


def resident_bytes(*looks, budget=0):
    """Return the resident memory after these runs of one separate process, which holds no other test's memory."""
    command = [sys.executable, "-c", PROGRAM, str(max(looks)), str(budget), *map(str, looks)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [int(line) for line in done.stdout.split()]


@pytest.mark.parametrize("fidelity", ["winkler", "auto"])
@pytest.mark.parametrize("own", [(), BOTH, ("pose_source.backend=mock-truth-camera",), ("job.backend=watch",)])
def test_a_run_goes_with_its_last_reference(own, fidelity):
    gc.collect()
    gc.disable()
    try:
        with lsds.bring_up(overrides=[*SHORT, *own, f"cell.simulated.fidelity={fidelity}"]) as engine:
            for at, _ in enumerate(engine):
                if at == 20:
                    break
            rig = engine.rig
            parts = [weakref.ref(part) for part in (engine, rig, rig.cell, rig.cell.plant, rig.sensor)]
        del engine, rig, _
        assert [part() for part in parts] == [None] * len(parts)
    finally:
        gc.enable()


def test_a_session_goes_with_its_last_reference():
    gc.collect()
    gc.disable()
    try:
        session = lsds.run(overrides=[*SHORT, "cell.simulated.fidelity=winkler"])
        record = weakref.ref(session.record)
        del session
        assert record() is None
    finally:
        gc.enable()


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_runs_of_different_objects_and_gels_leave_little():
    early, late = resident_bytes(4, 16, budget=128 * 2**20)
    # Each run that is not released holds some 30 MB.
    assert late - early < 120e6


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_two_hundred_runs_stay_within_150_mb_of_the_tenth():
    tenth, last = resident_bytes(10, 200)
    assert last - tenth < 150e6
