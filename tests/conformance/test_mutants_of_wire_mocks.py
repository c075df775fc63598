"""Every mistake of a wire mock is found by its check, and an honest one passes all of them."""

from __future__ import annotations

import mutants_wire_mocks
import pytest
from catching import CAUGHT_WIRE_MOCKS, require_caught
from fake_cell import plugin
from honest_wire_mock import HonestWireMock

from lsds.contracts import BackendSpec
from lsds.registry import PluginHost
from lsds.testing import Bench, cases
from lsds.testing.option_keys import OPTION_CHECKS


def bench(mock):
    host = PluginHost(entry_points=[])
    spec = BackendSpec(
        "wire_mock", mock.__name__.lower(), f"{mock.__module__}:{mock.__name__}", "honest_wire_mock:Options"
    )
    host.register(plugin(spec), distribution="mutants", name="mutants")
    return Bench("wire_mock", spec.name, host=host)


HONEST_CASES = cases(bench(HonestWireMock))


@pytest.mark.parametrize("case", HONEST_CASES, ids=lambda case: case.id)
def test_an_honest_wire_mock_passes(case):
    result = case.run()
    assert result.outcome == "passed", result


@pytest.mark.parametrize("mutant", CAUGHT_WIRE_MOCKS, ids=lambda mutant: mutant.__name__)
def test_a_mutant_is_caught_by_the_check_of_its_mistake(mutant):
    check, match = CAUGHT_WIRE_MOCKS[mutant]
    require_caught(bench(mutant), check, match, "docs/plugins.md#wire-mocks")


def test_mutants_are_registered():
    assert {mutant.__module__ for mutant in CAUGHT_WIRE_MOCKS} == {mutants_wire_mocks.__name__}
    assert len(CAUGHT_WIRE_MOCKS) > 15


def test_every_check_catches_a_mutant():
    assert {case.check for case in HONEST_CASES} - {*OPTION_CHECKS} == {
        check for check, _ in CAUGHT_WIRE_MOCKS.values()
    }


def test_a_mock_that_takes_another_port_each_time_cannot_be_in_use():
    (case,) = [case for case in cases(bench(HonestWireMock)) if case.name == "refuses_an_address_in_use"]
    case.bench.options = {"port": 0}
    assert case.run().outcome == "not applicable"
