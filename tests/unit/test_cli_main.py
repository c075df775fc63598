from __future__ import annotations

import json
import subprocess
import sys

import click
import pytest

from lsds.cli import main as module
from lsds.cli.main import COMMANDS, main
from lsds.errors import ConfigError, ConfigIssue, DeviceError, SafetyStop


@pytest.fixture
def command(monkeypatch):
    """Install a command that raises a given error."""

    def install(error):
        @click.command()
        def boom():
            raise error

        monkeypatch.setattr(module, "boom", boom, raising=False)
        monkeypatch.setitem(COMMANDS, "boom", ("lsds.cli.main:boom", "raises"))

    return install


def test_help_lists_every_command(capsys):
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert all(f"  {name}" in out for name in COMMANDS)
    assert "Examples:" in out


@pytest.mark.parametrize("name", ["plugins", "config", "learn", "devices", "completion"])
def test_every_command_has_help_with_examples(capsys, name):
    assert main([name, "--help"]) == 0
    assert "Examples:" in capsys.readouterr().out


def test_a_wrong_command_is_one_clear_error(capsys):
    assert main(["plugns"]) == 2
    assert "Did you mean 'plugins'?" in capsys.readouterr().err
    assert main(["zzz"]) == 2
    assert "Commands: run, track" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (ConfigError("rig.toml", [ConfigIssue("a", "is wrong")]), 2),
        (DeviceError("hand-e", "no answer", remedy="check the cable"), 4),
        (SafetyStop("watchdog"), 7),
    ],
)
def test_an_error_is_one_message_and_its_exit_code(command, capsys, error, code):
    error.add_note("and this")
    command(error)
    assert main(["boom"]) == code
    captured = capsys.readouterr()
    assert captured.err == f"error: {error}\n  and this\n"
    assert captured.out == ""
    with pytest.raises(type(error)):
        main(["--debug", "boom"])


def test_a_group_of_errors_is_explained_one_by_one(command, capsys):
    command(ExceptionGroup("closing the rig", [DeviceError("a", "stuck"), SafetyStop("b")]))
    assert main(["boom"]) == 7
    assert capsys.readouterr().err.splitlines() == ["error: closing the rig", "error: a: stuck", "error: b"]


def test_a_defect_is_not_hidden(command):
    command(ZeroDivisionError())
    with pytest.raises(ZeroDivisionError):
        main(["boom"])


def test_an_interrupt_is_130(command, capsys):
    command(KeyboardInterrupt())
    assert main(["boom"]) == 130
    assert "interrupted" in capsys.readouterr().err


def test_a_command_that_cannot_be_imported_is_an_error(monkeypatch, capsys):
    monkeypatch.setitem(COMMANDS, "gone", ("lsds.cli.gone_module:gone", ""))
    assert main(["gone"]) == 1
    assert "the command 'gone' cannot be loaded" in capsys.readouterr().err


def test_a_closed_output_pipe_is_no_traceback():
    script = f"{sys.executable} -m lsds.cli.main config schema | head -c 10"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=False)
    assert done.stderr == ""


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from lsds.cli.main import main; main(['--help'])\n"
        "heavy = {'numpy', 'cv2', 'matplotlib', 'pydantic', 'torch', 'lsds_research.cli'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(capsys, shell):
    assert main(["completion", shell]) == 0
    assert "_LSDS_COMPLETE" in capsys.readouterr().out


def test_completing_a_command_name_imports_no_command():
    code = (
        "import sys, click, json; from lsds.cli.main import cli\n"
        "items = cli.shell_complete(click.Context(cli), 'pl')\n"
        "print(json.dumps([[i.value for i in items], 'lsds.cli.plugins' in sys.modules]))"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert json.loads(done.stdout) == [["plugins"], False]
