"""The pages of docs/plugins: their code passes the checks of its kind, and works in a simulated lift."""

from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path

import pytest

from lsds.config import load_config
from lsds.contracts import KINDS
from lsds.rig import Rig
from lsds.session.run import _run
from lsds.testing import Bench, run_checks

PAGES = Path(__file__).parents[2] / "docs" / "plugins"
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)
MISSING = {"sensor", "arm", "pose_source", "wire_mock"}
"""Kinds whose page is still to be written."""
ELSEWHERE = {"cell", "study", "learner", "command"}
"""Kinds that docs/plugins.md explains, or that plugins do not add."""
WRITTEN = sorted(set(KINDS) - MISSING - ELSEWHERE)
NOT_CHOSEN = {"fault", "wire_mock"}
"""Kinds without a section in a config, which are tested otherwise."""


@pytest.fixture
def backend(request, tmp_path, monkeypatch, installed_host):
    kind = request.param
    name = f"acme_{kind}"
    code = "\n\n".join(BLOCK.findall((PAGES / f"{kind}.md").read_text(encoding="utf-8")))
    (tmp_path / f"{name}.py").write_text(code, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    module = importlib.import_module(name)
    (spec,) = module.lsds_backends()
    installed_host.register(module, distribution=name, name=name)
    yield installed_host, spec
    sys.modules.pop(name, None)


def test_every_kind_has_a_page_or_is_listed_as_missing():
    assert {page.stem for page in PAGES.glob("*.md")} == set(WRITTEN)


@pytest.mark.parametrize("backend", WRITTEN, indirect=True)
def test_the_code_of_a_page_passes_the_checks(backend):
    host, spec = backend
    results = run_checks(Bench(spec.kind, spec.name, host=host))
    assert results
    assert [result.message for result in results if result.outcome == "failed"] == []


@pytest.mark.parametrize("backend", sorted(set(WRITTEN) - NOT_CHOSEN), indirect=True)
def test_the_code_of_a_page_lifts(backend):
    host, spec = backend
    config = load_config(None, [f"{spec.kind}.backend={spec.name}", "task.lift_s=1.0"], host=host)
    with Rig(config, host) as rig:
        rig.arm_devices()
        session = _run(rig, None, None)
    assert session.fault is None
    assert session.summary["outcome"] == "held"


@pytest.mark.parametrize("backend", ["fault"], indirect=True)
def test_the_fault_of_its_page_ends_a_run_as_the_page_says(backend):
    host, spec = backend
    sessions = []
    for severity in (1, 5):
        fault = f'faults=[{{backend = "{spec.name}", severity = {severity}, at = "lift"}}]'
        with Rig(load_config(None, ["task.lift_s=1.0", fault], host=host), host) as rig:
            rig.arm_devices()
            sessions.append(_run(rig, None, None))
    harmless, worst = sessions
    assert (harmless.fault, harmless.summary["outcome"]) == (None, "held")
    assert worst.summary["outcome"] == "fault"
    assert re.search("gripper.*nothing told them to", worst.summary["fault"])
    assert not worst.truths[-1].dropped
