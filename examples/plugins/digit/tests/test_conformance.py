"""The conformance kit of lsds: the driver on a fake camera, and the sensor in the cell."""

from __future__ import annotations

from typing import Any

import pytest
from lsds.testing import Bench, Case, cases, conformance, run_checks

from conftest import Desk

OPTIONS = {"serial": "D20790"}
CHECKS = [case.name for case in cases(Bench("sensor", "digit", options=OPTIONS))]


@conformance("sensor", "mock-digit")
def test_the_sensor_in_the_cell_keeps_its_contract(check: Case) -> None:
    check()


@pytest.mark.parametrize("name", CHECKS)
def test_the_driver_keeps_its_contract(name: str, desk: Desk) -> None:
    def unplug(_: Any) -> None:
        desk.capture.unplugged = True

    bench = Bench("sensor", "digit", OPTIONS, allow_motion=True, unplug=unplug)
    (result,) = run_checks(bench, only=[name])
    assert result.outcome in ("passed", "not applicable"), f"{result.outcome}: {result.message}"
