"""Every installed device that runs on simulated time keeps the contract."""

from __future__ import annotations

import importlib.util
from importlib.metadata import EntryPoint

import pytest

from lsds.plugins import PluginHost
from lsds.testing import Bench, cases

KINDS = ("sensor", "gripper", "arm", "pose_source")
FIRST_PARTY = ("lsds_plugins", "lsds_drivers", "lsds_mocks")
NEEDS_DATA = frozenset({"replay"})
"""Backends that cannot run without a file of the user's; their own tests bring one."""


def installed_host() -> PluginHost:
    host = PluginHost()
    if host.backends:
        return host
    # A checkout that is not installed has no entry points; take those of pyproject.toml.
    return PluginHost(
        entry_points=[
            EntryPoint(name.replace("_", "-"), f"{name}.manifest", "lsds")
            for name in FIRST_PARTY
            if importlib.util.find_spec(name) is not None and importlib.util.find_spec(f"{name}.manifest") is not None
        ]
    )


HOST = installed_host()
SIMULATED = [
    backend
    for backend in HOST.backends
    if backend.spec.kind in KINDS and backend.spec.virtual_time and backend.spec.name not in NEEDS_DATA
]
CASES = [case for backend in SIMULATED for case in cases(Bench(backend.spec.kind, backend.spec.name, host=HOST))]


def has_mocks() -> bool:
    return importlib.util.find_spec("lsds_mocks") is not None and (
        importlib.util.find_spec("lsds_mocks.manifest") is not None
    )


def test_simulated_devices_are_found():
    if not has_mocks():
        pytest.skip("lsds_mocks has no manifest in this checkout")
    assert not [failure for failure in HOST.failures if failure.plugin == "lsds-mocks"]
    assert {backend.spec.kind for backend in SIMULATED} >= {"sensor", "gripper", "arm"}


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.id)
def test_conformance(case):
    case()
