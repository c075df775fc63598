"""`lsds study`: runs any study of a plugin, with flags made from its options and with --set."""

from __future__ import annotations

import json
from typing import Literal

import pytest
from click.testing import CliRunner
from fake_cell import plugin
from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.main import cli
from lsds.contracts import BackendSpec, StudyResult, StudyTable
from lsds.errors import ConfigError, DataError, MissingExtra, PluginConflict
from lsds.registry import PluginHost


class Options(BaseModel):
    """Measure the given things.

    \b
    Examples:
      lsds study echo --of a
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    names: list[str] = Field(default=[], description="of whom", json_schema_extra={"flag": "--of", "metavar": "WHO"})
    count: int = Field(default=3, ge=1, description="how many")
    step_ms: float = 2.5
    mode: Literal["fast", "slow"] = "fast"
    grid: Literal[1, 2, 4] = 1
    draws: bool = True
    table: dict[str, int] | None = None
    out: str = Field(default="", json_schema_extra={"writes": True})


class Clashing(BaseModel):
    plot: str = ""
    overrides: int = 0
    set: int = 0


class Needy(BaseModel):
    data: str = Field(description="folder")
    seed: int = Field(default=7, description="of the data")


class Echo:
    """A study that gives back its options."""

    def __init__(self, options, context):
        self.options, self.seed = options, context.seed

    def run(self, tick):
        tick(1, 1)
        given = {} if self.options is None else self.options.model_dump()
        rows = [{"key": key, "value": str(value)} for key, value in given.items()] or [{"key": "none", "value": ""}]
        draws = given.get("draws", True)
        return StudyResult(
            "echo, simulated",
            (("key", "key", ""), ("value", "value", "")),
            rows,
            (lambda path: path.write_bytes(b"PNG")) if draws else None,
            ["a note"],
            {"given": given, "seed": self.seed},
            [StudyTable((("n", "number", ".1f"),), [{"n": 1}])],
            ["a warning"],
        )


def undrawable(options, context):
    study = Echo(options, context)

    def draw(path):
        raise ModuleNotFoundError("No module named 'matplotlib'", name="matplotlib")

    class Study:
        def run(self, tick):
            found = study.run(tick)
            return StudyResult(found.title, found.columns, found.rows, draw)

    return Study()


HERE = "unit_study_plugin"


@pytest.fixture
def host(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, HERE, sys.modules[__name__])
    made = PluginHost(entry_points=[])
    made.register(
        plugin(
            BackendSpec("study", "echo", f"{HERE}:Echo", f"{HERE}:Options", summary="gives back its options"),
            BackendSpec("study", "plain", f"{HERE}:Echo", summary="takes no options"),
            BackendSpec("study", "needy", f"{HERE}:Echo", f"{HERE}:Needy"),
            BackendSpec("study", "clashing", f"{HERE}:Echo", f"{HERE}:Clashing"),
            BackendSpec("study", "undrawable", f"{HERE}:undrawable"),
            BackendSpec("study", "broken", f"{HERE}:Echo", f"{HERE}:Gone", summary="its options are gone"),
        ),
        distribution="acme",
    )
    return made


@pytest.fixture
def lsds(host, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(cli, arguments, obj=host)


def parsed(done):
    assert done.exit_code == 0, (done.output, done.exception)
    return json.loads(done.stdout)


def test_the_same_options_by_flags_and_by_set(lsds):
    by_flags = parsed(
        lsds(
            "study",
            "echo",
            "--of",
            "a",
            "--of",
            "b",
            "--count",
            "5",
            "--step-ms",
            "1",
            "--mode",
            "slow",
            "--grid",
            "4",
            "--no-draws",
            "--table",
            "{a = 1}",
            "--json",
            "-",
        )
    )
    by_set = parsed(
        lsds(
            "study",
            "echo",
            "--set",
            'names=["a", "b"]',
            "--set",
            "count=5",
            "--set",
            "step_ms=1.0",
            "--set",
            "mode=slow",
            "--set",
            "grid=4",
            "--set",
            "draws=false",
            "--set",
            "table={a = 1}",
            "--json",
            "-",
        )
    )
    assert by_flags["given"] == {
        "names": ["a", "b"],
        "count": 5,
        "step_ms": 1.0,
        "mode": "slow",
        "grid": 4,
        "draws": False,
        "table": {"a": 1},
        "out": "",
    }
    assert by_flags == by_set
    assert by_flags["tables"] == [[{"n": 1}]]


def test_tables_notes_files_and_the_picture_of_its_name(lsds, tmp_path):
    done = lsds("study", "echo", "--csv", "t.csv")
    assert done.exit_code == 0
    assert done.stdout.startswith("echo, simulated\n\nnumber\n------\n1.0\n\nkey")
    assert "a note" in done.stdout
    assert "a warning" in done.stderr
    assert (tmp_path / "echo.png").read_bytes() == b"PNG"
    assert (tmp_path / "t.csv").read_text().startswith("key,value\n")
    assert lsds("study", "echo", "--no-plot", "--seed", "3").exit_code == 0
    assert lsds("study", "echo", "--plot", "own.png").exit_code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"echo.png", "own.png", "t.csv"}


def test_the_seed_is_the_run_s_and_the_option_of_that_name(lsds):
    assert parsed(lsds("study", "echo", "--seed", "3", "--json", "-"))["seed"] == 3
    assert parsed(lsds("study", "needy", "--data", "x", "--json", "-"))["seed"] == 7
    by_flag = parsed(lsds("study", "needy", "--data", "x", "--seed", "3", "--json", "-"))
    assert (by_flag["seed"], by_flag["given"]["seed"]) == (3, 3)
    assert parsed(lsds("study", "needy", "--set", "data=x", "--set", "seed=4", "--json", "-"))["seed"] == 4


def test_options_called_like_a_common_flag_are_set_by_set(lsds):
    done = lsds("study", "clashing", "--set", "plot=x", "--set", "overrides=2", "--set", "set=3", "--json", "-")
    assert parsed(done)["given"] == {"plot": "x", "overrides": 2, "set": 3}


def test_all_are_listed_and_a_broken_one_does_not_affect_the_others(lsds):
    for arguments in (["study"], ["study", "--help"]):
        done = lsds(*arguments)
        assert done.exit_code == 0
        assert "gives back its options" in done.output
        assert "its options are gone" in done.output
    assert "importing" in str(lsds("study", "broken").exception)
    assert lsds("study", "plain", "--no-plot").exit_code == 0


def test_help_has_flags_defaults_choices_and_examples(lsds):
    text = " ".join(lsds("study", "echo", "--help").output.split())
    for part in (
        "Measure the given things.",
        "--of WHO Of whom; repeatable.",
        "--count N How many. [default: 3]",
        "--mode [fast|slow]",
        "--grid [1|2|4]",
        "--draws / --no-draws",
        "[default: echo.png]",
        "lsds study echo --of a",
    ):
        assert part in text
    text = lsds("study", "plain", "--help").output
    assert "Takes no options" in text
    assert "lsds study plain" in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["ecko"], "Did you mean 'echo'?"),
        (["echo", "--count", "many"], "'many' is not a valid integer"),
        (["echo", "--mode", "slwo"], "is not one of 'fast', 'slow'"),
        (["needy"], "Missing option '--data'"),
        (["echo", "--conut", "2"], "No such option"),
    ],
)
def test_what_was_mistyped_is_one_message(lsds, arguments, message):
    done = lsds("study", *arguments)
    assert done.exit_code == 2
    assert message in done.output


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (["echo", "--count", "0"], ConfigError, "study.echo.count: should be greater than or equal to 1, got 0"),
        (["echo", "--set", "conut=2"], ConfigError, r"unknown key \(did you mean 'count'\?\)"),
        (["echo", "--set", "count"], ConfigError, "has no '='"),
        (["plain", "--set", "count=2"], ConfigError, "takes no options"),
        (["echo", "--csv", "no/such/t.csv"], DataError, "create the folder first"),
        (["echo", "--out", "no/such/model"], DataError, "create the folder first"),
        (["undrawable", "--plot", "p.png"], MissingExtra, r"lsds-tactile\[plot\]"),
    ],
)
def test_what_is_not_allowed_is_an_error_of_lsds(lsds, monkeypatch, arguments, error, message):
    import sys

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = lsds("study", *arguments)
    assert isinstance(done.exception, error)
    with pytest.raises(error, match=message):
        raise done.exception


def test_a_picture_that_was_not_requested_may_be_missing(lsds, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = lsds("study", "undrawable")
    assert done.exit_code == 0
    assert "echo, simulated" in done.stdout
    assert "no picture: this needs matplotlib" in done.stderr


def test_two_of_one_name_are_selected_by_distribution(lsds, host):
    host.register(plugin(BackendSpec("study", "echo", f"{HERE}:Echo")), distribution="other")
    assert isinstance(lsds("study", "echo").exception, PluginConflict)
    assert parsed(lsds("study", "other:echo", "--json", "-"))["given"] == {}


def test_names_are_completed_without_importing_any(host):
    import click

    from lsds.cli.study import study

    ctx = click.Context(study, obj=host)
    assert [item.value for item in study.shell_complete(ctx, "b")] == ["broken"]
    assert [item.value for item in study.shell_complete(ctx, "--h")] == ["--help"]
    ctx.resilient_parsing = True
    assert study.get_command(ctx, "broken") is None
