"""The kit finds options that ignore a misspelt key."""

from __future__ import annotations

import pytest
from fake_cell import plugin
from honest import HonestDetector
from pydantic import BaseModel, ConfigDict

from lsds.contracts import BackendSpec
from lsds.registry import PluginHost
from lsds.testing import Bench, run_checks
from lsds.testing.option_keys import check_unknown_options_are_refused


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")
    port: str
    gain: float = 1.0


class Lenient(BaseModel):
    gain: float = 1.0


class Keeps(BaseModel):
    model_config = ConfigDict(extra="allow")
    gain: float = 1.0


def bench(options=None):
    host = PluginHost(entry_points=[])
    place = None if options is None else f"{__name__}:{options.__name__}"
    spec = BackendSpec("detector", "honest", f"{HonestDetector.__module__}:HonestDetector", options=place)
    host.register(plugin(spec), distribution="mutants", name="mutants")
    return Bench("detector", "honest", host=host)


def test_options_that_refuse_unknown_keys_pass_even_if_others_are_missing():
    check_unknown_options_are_refused(bench(Strict))


@pytest.mark.parametrize("options", [Lenient, Keeps])
def test_options_that_accept_a_misspelt_key_are_found(options):
    with pytest.raises(AssertionError, match=r"accepts an option 'no_such_option'.*; give it model_config"):
        check_unknown_options_are_refused(bench(options))


def test_a_backend_without_options_refuses_all():
    (result,) = run_checks(bench(), ["unknown_options_are_refused"])
    assert result.outcome == "passed"
