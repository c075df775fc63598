"""The conformance kit of lsds: the driver on the fake hand."""

from __future__ import annotations

from typing import Any

import pytest
from lsds.clock import Clock
from lsds.testing import Bench, cases, run_checks

from lsds_franka_hand import mock
from lsds_franka_hand.fake import Fingers
from lsds_franka_hand.mock import NAME

CHECKS = [case.name for case in cases(Bench("gripper", NAME))]


@pytest.mark.parametrize("name", CHECKS)
def test_the_driver_keeps_its_contract(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    shared: list[Fingers] = []

    def kept(clock: Clock, object_m: float) -> Fingers:
        shared.append(Fingers(clock, object_m))
        return shared[-1]

    monkeypatch.setattr(mock, "Fingers", kept)

    def unplug(_: Any) -> None:
        shared[-1].lost = True

    bench = Bench("gripper", NAME, allow_motion=True, unplug=unplug)
    (result,) = run_checks(bench, only=[name])
    assert result.outcome in ("passed", "not applicable"), f"{result.outcome}: {result.message}"
