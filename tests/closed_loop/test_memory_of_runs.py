"""A finished run keeps its figures, and not the cell: also where it ended with an error, and while its session is
kept."""

from __future__ import annotations

import gc

import pytest
from lsds_mocks.cell.cell import SimulatedCell

from lsds.session.run import run

SHORT = ["task.lift_s=0.3", "task.hold_s=0.1", "cell.simulated.fidelity=winkler"]


def cells():
    return sum(isinstance(each, SimulatedCell) for each in gc.get_objects())


def held(*faults):
    """Return a session, as a caller that keeps it among its variables."""
    session = run(None, [*SHORT, *faults])
    session.require_uninterrupted()
    return session


@pytest.mark.parametrize(
    "fault", ["", "camera-gone", "camera-dark", "detector-raises", "controller-nan", "gripper-crc", "arm-gone"]
)
def test_a_session_does_not_keep_the_cell(fault):
    held()
    gc.collect()
    before = cells()
    gc.disable()
    try:
        session = held(*([f'faults=[{{backend="{fault}", severity=5, at="lift"}}]'] if fault else []))
        assert (session.fault is not None) == bool(fault)
        assert cells() == before
    finally:
        gc.enable()
