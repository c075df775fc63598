"""Every installed device that runs on simulated time keeps the contract."""

from __future__ import annotations

import pytest
from installed import has_manifest, installed_host

from lsds.testing import Bench, cases

KINDS = ("sensor", "gripper", "arm", "pose_source")
NEEDS_DATA = frozenset({"video", "recording"})
"""Backends that cannot run without a file of the user's; their own tests bring one."""


HOST = installed_host()
SIMULATED = [
    backend
    for backend in HOST.backends
    if backend.spec.kind in KINDS and backend.spec.virtual_time and backend.spec.name not in NEEDS_DATA
]
CASES = [case for backend in SIMULATED for case in cases(Bench(backend.spec.kind, backend.spec.name, host=HOST))]
RIGHT_FINGER = cases(Bench("sensor", "mock-gelsight-mini", {"finger": "right"}, host=HOST))


def test_simulated_devices_are_found():
    if not has_manifest("lsds_mocks"):
        pytest.skip("lsds_mocks has no manifest in this checkout")
    assert not [failure for failure in HOST.failures if failure.plugin == "lsds-mocks"]
    assert {backend.spec.kind for backend in SIMULATED} >= {"sensor", "gripper", "arm"}


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.id)
def test_conformance(case):
    case()


@pytest.mark.parametrize("case", RIGHT_FINGER, ids=lambda case: case.id)
def test_the_right_finger(case):
    case()
