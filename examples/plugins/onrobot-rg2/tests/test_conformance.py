"""The conformance kit of lsds: the driver over a TCP port, the gripper in the cell, and the wire mock."""

from __future__ import annotations

from typing import Any

import pytest
from lsds.testing import Bench, Case, cases, conformance, run_checks

from conftest import Box

CHECKS = [case.name for case in cases(Bench("gripper", "onrobot-rg2", options={"host": "127.0.0.1"}))]


@conformance("gripper", "mock-onrobot-rg2")
def test_the_gripper_in_the_cell_keeps_its_contract(check: Case) -> None:
    check()


@conformance("wire_mock", "onrobot-rg2")
def test_the_wire_mock_keeps_its_contract(check: Case) -> None:
    check()


@pytest.mark.parametrize("name", CHECKS)
def test_the_driver_keeps_its_contract_over_tcp(name: str, box: Box) -> None:
    def unplug(_: Any) -> None:
        box.server.inject({"kind": "silent"})

    bench = Bench("gripper", "onrobot-rg2", box.options, allow_motion=True, unplug=unplug)
    (result,) = run_checks(bench, only=[name])
    assert result.outcome in ("passed", "not applicable"), f"{result.outcome}: {result.message}"
