"""Every installed wire mock keeps the contract."""

from __future__ import annotations

import pytest
from installed import has_manifest, installed_host

from lsds.testing import Bench, cases

HOST = installed_host()
FOUND = [backend.spec.name for backend in HOST.backends if backend.spec.kind == "wire_mock"]
CASES = [case for name in FOUND for case in cases(Bench("wire_mock", name, host=HOST))]


def test_wire_mocks_are_found():
    if not has_manifest("lsds_mocks"):
        pytest.skip("lsds_mocks has no manifest in this checkout")
    assert {"hand-e", "ur5e", "gelsight-mini", "truth-camera", "plant"} <= set(FOUND)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.id)
def test_conformance(case):
    case()
