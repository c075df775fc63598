"""Checks of commands: each explains itself at once, and refuses wrong use. No check invokes the command."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass

import click

from lsds.support.processes import isolated_environment, module_command
from lsds.testing.bench import Bench
from lsds.testing.help_probe import FOUND

UNKNOWN = "--no-such-option"
HEAVY = (
    "cv2",
    "jax",
    "matplotlib",
    "numba",
    "onnx",
    "onnxruntime",
    "pandas",
    "pyarrow",
    "scipy",
    "sklearn",
    "tensorflow",
    "torch",
)
"""Libraries that take long to import."""
PROBED_S = 60.0
"""Time limit of a command in a separate process, s; chosen."""


def check_is_a_click_command(bench: Bench) -> None:
    """The factory names a click command or group, which is not called to build it."""
    _command(bench)


def check_help_names_it(bench: Bench) -> None:
    """`--help` exits with 0 and shows its usage with its name; the same holds for the commands of a group."""
    for parsed in _each(bench, "--help"):
        assert parsed.code == 0, (
            f"{parsed.path} --help ends with exit code {parsed.code}: {parsed.err.strip()[-200:]!r}; keep click's help "
            "option, and let no callback of an option fail before it"
        )
        assert f"Usage: {parsed.path}" in parsed.out, (
            f"{parsed.path} --help begins with {parsed.out.strip()[:60]!r}; let click write the usage, 'Usage: "
            f"{parsed.path} ...'"
        )


def check_has_a_summary(bench: Bench) -> None:
    """The help begins with one line of summary; the backend has one, too, which `lsds --help` lists."""
    listed = bench.host.find(bench.kind, bench.name).spec.summary
    assert len(listed.strip().splitlines()) == 1, (
        f"the backend's summary is {listed!r}; give BackendSpec(summary=...) one line, which `lsds --help` lists"
    )
    for parsed in _each(bench, "--help"):
        text = (parsed.command.help or "").strip()
        first = text.split("\n\n")[0].strip("\b\f\n ")
        assert first, f"{parsed.path} has no help; begin its docstring with one line of summary"
        assert "\n" not in first, f"{parsed.path}: the summary {first!r} has several lines; use one, then a blank line"


def check_refuses_an_unknown_option(bench: Bench) -> None:
    """An unknown option ends with exit code 2 and a line of usage; the same holds for the commands of a group."""
    for parsed in _each(bench, UNKNOWN):
        assert parsed.code is not None, (
            f"{parsed.path} {UNKNOWN} is accepted; leave ignore_unknown_options out, so that a typing error is found"
        )
        assert parsed.code == 2, (
            f"{parsed.path} {UNKNOWN} ends with exit code {parsed.code}; let click refuse it, or raise click.UsageError"
        )
        assert "Usage: " in parsed.err, (
            f"{parsed.path} {UNKNOWN} prints {parsed.err.strip()[:80]!r} without a line of usage; raise "
            "click.UsageError(message, ctx)"
        )


def check_help_is_cheap(bench: Bench) -> None:
    """Importing the command and showing its help imports no heavy library, such as torch, scipy or matplotlib."""
    factory = bench.host.find(bench.kind, bench.name).spec.factory
    environment = isolated_environment({"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)})
    run = module_command("lsds.testing.help_probe", factory, *HEAVY)
    done = subprocess.run(run, capture_output=True, text=True, env=environment, timeout=PROBED_S, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith(FOUND)]
    assert lines, (
        f"the help of {factory} fails in a separate process: {done.stderr.strip().rpartition(chr(10))[2]!r}; import "
        "what the module needs in it"
    )
    heavy = lines[-1].split()[1:]
    assert not heavy, f"showing its help imports {', '.join(heavy)}; import it inside the function that needs it"


@dataclass(frozen=True)
class _Parsed:
    """How the arguments of a command were parsed. `code` is the exit code, None if it would be invoked."""

    path: str
    command: click.Command
    code: int | None
    out: str
    err: str


def _command(bench: Bench) -> click.Command:
    backend = bench.host.find(bench.kind, bench.name)
    found = bench.host.imported(backend)
    assert isinstance(found, click.Command), (
        f"'{backend.spec.factory}' is {type(found).__name__}, not a click command; decorate the function with "
        "@click.command() or @click.group()"
    )
    return found


def _each(bench: Bench, argument: str) -> Iterator[_Parsed]:
    """Yield how the command, and every command of a group, takes an argument."""
    root = click.Context(click.Command("lsds"), info_name="lsds", obj=bench.host)
    yield from _walk(_command(bench), bench.name.rpartition(":")[2], root, argument)


def _walk(command: click.Command, name: str, parent: click.Context, argument: str) -> Iterator[_Parsed]:
    yield _parsed(command, name, parent, argument)
    if isinstance(command, click.Group):
        ctx = click.Context(command, parent=parent, info_name=name)
        for inner in command.list_commands(ctx):
            found = command.get_command(ctx, inner)
            assert found is not None, f"{ctx.command_path} lists {inner!r} and has no such command; return it"
            yield from _walk(found, inner, ctx, argument)


def _parsed(command: click.Command, name: str, parent: click.Context, argument: str) -> _Parsed:
    """Parse an argument without invoking the command. Raises AssertionError for any error but those of click."""
    out, err, code = io.StringIO(), io.StringIO(), None
    path = f"{parent.command_path} {name}"
    with redirect_stdout(out), redirect_stderr(err):
        try:
            command.make_context(name, [argument], parent=parent)
        except click.exceptions.Exit as request:
            code = request.exit_code
        except click.ClickException as error:
            error.show()
            code = error.exit_code
        except (Exception, SystemExit) as error:
            raise AssertionError(
                f"{path} {argument} raised {type(error).__name__}: {error}; raise click.UsageError for wrong use"
            ) from error
    return _Parsed(path, command, code, out.getvalue(), err.getvalue())


COMMAND_CHECKS = (
    check_is_a_click_command,
    check_help_names_it,
    check_has_a_summary,
    check_refuses_an_unknown_option,
    check_help_is_cheap,
)
