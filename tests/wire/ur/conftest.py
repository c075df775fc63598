"""One mock arm a module, and its address."""

from __future__ import annotations

import pytest
from lsds_mocks.mock_process import MockProcess

from tests.wire.ur.arms import fresh_host


@pytest.fixture(scope="module")
def arm():
    with MockProcess("ur5e", {"host": fresh_host()}) as process:
        yield process
        assert process.complaints == ""


@pytest.fixture
def host(arm):
    return arm.addresses["rtde"].partition(":")[0]
