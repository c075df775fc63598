"""Every mistake of a fault is found by its check, and honest faults pass all of them."""

from __future__ import annotations

import mutants_faults
import pytest
from catching import CAUGHT_FAULTS, require_caught
from fake_cell import plugin
from honest_faults import HONEST_FAULTS, Options

from lsds.contracts import BackendSpec
from lsds.registry import PluginHost
from lsds.testing import Bench, cases
from lsds.testing.option_keys import OPTION_CHECKS


def bench(fault):
    host = PluginHost(entry_points=[])
    options = getattr(fault, "OPTIONS", Options)
    spec = BackendSpec(
        "fault",
        fault.__name__.lower(),
        f"{fault.__module__}:{fault.__name__}",
        f"{options.__module__}:{options.__name__}",
    )
    host.register(plugin(spec), distribution="mutants", name="mutants")
    return Bench("fault", spec.name, host=host)


HONEST_CASES = [case for fault in HONEST_FAULTS for case in cases(bench(fault))]


@pytest.mark.parametrize("case", HONEST_CASES, ids=lambda case: case.id)
def test_an_honest_fault_passes(case):
    result = case.run()
    assert result.outcome in ("passed", "not applicable"), result


@pytest.mark.parametrize("mutant", CAUGHT_FAULTS, ids=lambda mutant: mutant.__name__)
def test_a_mutant_is_caught_by_the_check_of_its_mistake(mutant):
    check, match = CAUGHT_FAULTS[mutant]
    require_caught(bench(mutant), check, match, "docs/plugins.md#faults")


def test_mutants_are_registered():
    assert {mutant.__module__ for mutant in CAUGHT_FAULTS} == {mutants_faults.__name__}
    assert len(CAUGHT_FAULTS) > 20


def test_every_check_catches_a_mutant():
    checks = {case.check for case in HONEST_CASES} - {*OPTION_CHECKS}
    assert checks == {check for check, _ in CAUGHT_FAULTS.values()}


def test_a_fault_of_form_declares_it(monkeypatch):
    mutant = mutants_faults.HalvesTheImage
    monkeypatch.setattr(mutant, "malformed", True, raising=False)
    (case,) = [case for case in cases(bench(mutant)) if case.name == "answers_keep_their_form"]
    assert case.run().outcome == "passed"
