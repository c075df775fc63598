"""A library that is not installed is one line with the extra that brings it."""

from __future__ import annotations

import sys

import click
import pytest

from lsds.cli import main as module
from lsds.cli.main import COMMANDS, main
from lsds.errors import LsdsError, MissingExtra
from lsds.support.extras import EXTRAS, explained, importable, require


@pytest.fixture
def without(monkeypatch):
    """Make libraries as absent as if they were not installed."""

    def use(*names):
        for name in names:
            monkeypatch.setitem(sys.modules, name, None)

    return use


def test_an_installed_extra_is_no_error():
    require("json", "click", extra="sim")
    assert not importable("a_library_nobody_has")


def test_a_missing_one_is_named_with_its_remedy(without):
    without("matplotlib", "numba")
    with pytest.raises(MissingExtra, match=r"^a picture needs matplotlib, which is not .*; .*'lsds-tactile\[sim\]'$"):
        require("json", "matplotlib", extra="sim", purpose="a picture")
    with pytest.raises(LsdsError, match="needs matplotlib, numba, which are not installed"):
        require("matplotlib", "numba", extra="sim")


@pytest.mark.parametrize("name", sorted(EXTRAS))
def test_an_import_that_fails_is_explained_by_the_extra(without, name):
    without(name)
    with pytest.raises(ModuleNotFoundError) as caught:
        __import__(name)
    assert f"pip install 'lsds-tactile[{EXTRAS[name]}]'" in str(explained(caught.value))


def test_other_import_errors_are_left_alone(without):
    assert explained(ModuleNotFoundError("no", name="a_library_nobody_has")) is None
    assert explained(ModuleNotFoundError("no")) is None
    # It is there, and something is wrong inside: that is no matter of extras.
    assert explained(ImportError("cannot import name", name="click")) is None


@pytest.mark.parametrize("debug", [False, True])
def test_a_command_without_its_extra_is_an_error_of_one_line(without, monkeypatch, capsys, debug):
    without("pyarrow")

    @click.command()
    def needy():
        import pyarrow  # noqa: F401

    monkeypatch.setattr(module, "needy", needy, raising=False)
    monkeypatch.setitem(COMMANDS, "needy", ("lsds.cli.main:needy", "needs pyarrow"))
    if debug:
        with pytest.raises(ModuleNotFoundError):
            main(["--debug", "needy"])
        return
    assert main(["needy"]) == 3
    assert capsys.readouterr().err == (
        "error: this needs pyarrow, which is not installed; install with: pip install 'lsds-tactile[data]'\n"
    )
