"""Commands that plugins add to `lsds`: listed, run, and isolated if they fail."""

from __future__ import annotations

import sys

import click
import pytest
from click.testing import CliRunner
from fake_cell import plugin

from lsds.cli.main import COMMANDS, cli, main
from lsds.contracts import BackendSpec
from lsds.errors import ContractMismatch, PluginConflict, PluginLoadError
from lsds.registry import PluginHost

HERE = "unit_command_plugin"


@click.command()
@click.option("--times", default=1)
def greet(times):
    """Greet."""
    click.echo("hello " * times)


not_a_command = print


@pytest.fixture
def host(monkeypatch):
    monkeypatch.setitem(sys.modules, HERE, sys.modules[__name__])
    made = PluginHost(entry_points=[])
    made.register(
        plugin(
            BackendSpec("command", "greet", f"{HERE}:greet", summary="says hello"),
            BackendSpec("command", "run", f"{HERE}:greet", summary="takes what is ours"),
            BackendSpec("command", "gone", "no_such_module:gone", summary="cannot be imported"),
            BackendSpec("command", "odd", f"{HERE}:not_a_command"),
        ),
        distribution="acme",
    )
    made.register(object(), distribution="useless")
    return made


@pytest.fixture
def lsds(host):
    return lambda *arguments: CliRunner().invoke(cli, arguments, obj=host)


def test_it_is_listed_and_runs(lsds):
    listed = lsds("--help").output
    assert "greet" in listed
    assert "says hello" in listed
    assert lsds("greet", "--times", "2").output == "hello hello \n"
    assert "Greet." in lsds("greet", "--help").output


def test_a_built_in_command_goes_first(lsds):
    assert "takes what is ours" not in lsds("--help").output
    assert "Grasp, lift and hold" in lsds("run", "--help").output
    assert lsds("acme:run").output == "hello \n"


def test_one_failure_does_not_affect_the_others(lsds):
    assert "cannot be imported" in lsds("--help").output
    assert isinstance(lsds("gone").exception, PluginLoadError)
    assert isinstance(lsds("odd").exception, ContractMismatch)
    assert lsds("greet").exit_code == 0


def test_a_wrong_name_is_compared_with_those_of_plugins_too(lsds):
    done = lsds("greeet")
    assert done.exit_code == 2
    assert "Did you mean 'greet'?" in done.output


def test_two_of_one_name_are_selected_by_distribution(lsds, host):
    host.register(plugin(BackendSpec("command", "greet", f"{HERE}:greet")), distribution="other")
    assert isinstance(lsds("greet").exception, PluginConflict)
    assert lsds("other:greet").exit_code == 0


def test_completion_knows_it_and_survives_what_is_broken(host):
    ctx = click.Context(cli, obj=host, resilient_parsing=True)
    assert [item.value for item in cli.shell_complete(ctx, "gr")] == ["greet"]
    assert cli.get_command(ctx, "gone") is None


def test_a_built_in_command_asks_no_plugin(monkeypatch):
    monkeypatch.setattr(PluginHost, "backends", property(lambda self: pytest.fail("asked")))
    assert all(main([name, "--help"]) == 0 for name in COMMANDS if name not in ("study", "learn", "mock"))
