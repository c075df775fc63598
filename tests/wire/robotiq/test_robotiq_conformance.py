"""Every Robotiq driver keeps the contract of a gripper, against the mock of its wire."""

from __future__ import annotations

import pytest

from lsds.testing import Bench, cases
from tests.wire.robotiq.rig import DRIVERS, HOST, options_for, serving

OPTIONS: dict[str, dict] = {driver: {} for driver in DRIVERS}
"""Filled where the mock is running: a bench looks at it when it builds."""


@pytest.fixture(scope="module", autouse=True)
def mock(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("hand"), activated=True) as mock:
        for driver, options in OPTIONS.items():
            options.update(options_for(driver, mock))
        yield
        assert mock.complaints == ""


BENCHES = {
    driver: Bench("gripper", driver.removesuffix("-tcp"), OPTIONS[driver], HOST, allow_motion=True)
    for driver in DRIVERS
}
# One on a serial port and one on TCP each go through everything; what they share is not tried twice.
SKIPPED = {"hand-e-tcp": ("finishes_after_expiry", "any_order"), "robotiq-2f": ("finishes_after_expiry", "any_order")}
CASES = [
    pytest.param(case, id=f"{driver}-{case.check.__name__.removeprefix('check_')}")
    for driver, bench in BENCHES.items()
    for case in cases(bench)
    if not any(part in case.id for part in SKIPPED.get(driver, ()))
]


@pytest.mark.parametrize("case", CASES)
def test_conformance(case):
    case()
