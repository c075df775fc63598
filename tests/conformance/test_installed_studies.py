"""Every installed command, and the studies that take seconds, keep their contracts."""

from __future__ import annotations

import pytest
from installed import has_manifest, installed_host

from lsds.testing import Bench, cases

HOST = installed_host()
COMMANDS = [backend.spec.name for backend in HOST.backends if backend.spec.kind == "command"]
STUDIES = {
    "scheduler": {"repeats": 1},
    "gel": {"scenes": ["sphere"], "repeats": 1, "random": 0},
}
"""Studies with options that make them quick."""
FOUND = {backend.spec.name: backend for backend in HOST.backends if backend.spec.kind == "study"}
READY = [name for name in STUDIES if name in FOUND and not HOST.missing_requirements(FOUND[name])]
CASES = [case for name in COMMANDS for case in cases(Bench("command", name, host=HOST))]
CASES += [case for name in READY for case in cases(Bench("study", name, STUDIES[name], HOST))]


def test_commands_and_studies_are_found():
    if not has_manifest("lsds_research"):
        pytest.skip("lsds_research has no manifest in this checkout")
    assert {"collect", "label", "train", "choose", "reproduce"} <= set(COMMANDS)
    assert set(STUDIES) <= set(FOUND)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.id)
def test_conformance(case):
    case()
