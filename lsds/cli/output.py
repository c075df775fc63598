"""Output shared by all commands: tables, CSV, and strict JSON with stable keys, written atomically."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
import os
import sys
import tempfile
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import redirect_stdout, suppress
from contextvars import ContextVar
from enum import Enum
from pathlib import Path
from typing import Any, Protocol, TextIO, TypeVar

import click

from lsds.errors import DataError

F = TypeVar("F", bound=Callable[..., Any])


class Decorator(Protocol):
    """A decorator that adds an option to a command and keeps its type."""

    def __call__(self, command: F, /) -> F:
        """Return the command with the option."""
        ...


_kept: ContextVar[TextIO | None] = ContextVar("lsds_stdout", default=None)
"""The stream that JSON goes to while other output is diverted."""


def divert(ctx: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """Send all other output to stderr if the JSON goes to stdout: a plugin's print must not spoil it."""
    if value == "-" and not ctx.resilient_parsing and _kept.get() is None:
        kept = _kept.set(sys.stdout)
        ctx.call_on_close(lambda: _kept.reset(kept))
        ctx.with_resource(redirect_stdout(sys.stderr))
    return value


JSON_OPTION: dict[str, Any] = {
    "metavar": "FILE",
    "callback": divert,
    "help": "Write the result as JSON to FILE; '-' is stdout.",
}
"""Settings of every `--json FILE` option."""
json_option: Decorator = click.option("--json", "json_file", **JSON_OPTION)
"""The `--json FILE` option; the command receives it as `json_file`, None if it was not given."""

json_flag: Decorator = click.option(
    "--json",
    "json_file",
    metavar="[FILE]",
    is_flag=False,
    flag_value="-",
    default=None,
    callback=divert,
    help="Write the result as JSON to FILE; without FILE, to stdout.",
)
"""The same with an optional FILE. Only for commands without arguments: otherwise it could take an argument as FILE."""


verbose_option: Decorator = click.option(
    "--verbose", is_flag=True, help="Print every row of the summary, not only the most important ones."
)
"""The `--verbose` flag of commands whose whole summary is long; the JSON always holds all of it."""


def require_known(ctx: click.Context, arguments: Sequence[str], known: Collection[str]) -> None:
    """Raise click.UsageError for an unknown subcommand, with the nearest name as a suggestion."""
    from difflib import get_close_matches

    if arguments and arguments[0] not in known and not arguments[0].startswith("-"):
        near = get_close_matches(arguments[0], known, n=1)
        hint = f" Did you mean '{near[0]}'?" if near else f" Commands: {', '.join(known)}."
        ctx.fail(f"No such command '{arguments[0]}'.{hint}")


def to_json(value: Any) -> str:
    """Return JSON with sorted keys. NaN and infinities, which JSON cannot hold, become null."""
    return json.dumps(plain(value), indent=2, sort_keys=True, allow_nan=False, ensure_ascii=False) + "\n"


def write_json(value: Any, target: str | Path) -> None:
    """Write a value as JSON to a file, atomically, or to stdout for "-". Raises DataError on failure."""
    write_text(to_json(value), target)


def require_writable(target: str | Path | None) -> None:
    """Raise DataError if a result cannot be written to `target`; None and "-" are always accepted."""
    if target is None or str(target) == "-":
        return
    path = Path(target).resolve()
    if not path.parent.is_dir():
        raise DataError(f"{path}: cannot be written: the folder does not exist; create the folder first")
    if path.is_dir():
        raise DataError(f"{path}: cannot be written: it is a folder; give the name of a file in it")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise DataError(f"{path}: cannot be written: permission denied")


def require_writable_folder(folder: Path) -> None:
    """Make a folder, or check the one that is there. Raises DataError if no file can be written to it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise DataError(f"{folder}: cannot be written: {error} (choose another folder)") from error


def write_text(text: str, target: str | Path) -> None:
    """Write text to a file or to stdout for "-". Raises DataError on failure.

    The text is written to a temporary file in the same folder, which then replaces the target: a reader sees either the
    old or the new content.
    """
    if str(target) == "-":
        click.echo(text, nl=False, file=_kept.get())
        return
    path = Path(target).resolve()  # Keep a symbolic link and replace its target.
    if path.exists() and not path.is_file():  # /dev/stdout or a pipe cannot be replaced.
        try:
            path.write_text(text, encoding="utf-8")
        except OSError as error:
            raise DataError(f"{path}: cannot be written: {error.strerror}") from error
        return
    temporary = None
    try:
        with tempfile.NamedTemporaryFile(
            "w", encoding="utf-8", dir=path.parent, prefix=f".{path.name}.", delete=False
        ) as file:
            temporary = file.name
            file.write(text)
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except OSError as error:
        if temporary is not None:
            with suppress(OSError):
                os.unlink(temporary)
        remedy = "; create the folder first" if not path.parent.is_dir() else ""
        raise DataError(f"{path}: cannot be written: {error.strerror}{remedy}") from error


def plain(value: Any) -> Any:
    """Return a value as dicts, lists, strings and numbers: dataclasses, enums, paths and numpy values included."""
    if value is None or isinstance(value, bool | int | str):
        return value.value if isinstance(value, Enum) else value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Enum):
        return plain(value.value)
    if isinstance(value, Mapping):
        return {str(key.value if isinstance(key, Enum) else key): plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(inner) for inner in (sorted(value) if isinstance(value, set | frozenset) else value)]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, type):
        raise TypeError(f"cannot write the type {value.__name__} as JSON")
    if dataclasses.is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    for whole in ("model_dump", "tolist"):
        if hasattr(value, whole):
            return plain(getattr(value, whole)())
    raise TypeError(f"cannot write a {type(value).__name__} as JSON")


def csv_text(rows: Sequence[Mapping[str, object]]) -> str:
    """Return rows of a table as CSV with a header of their keys; a key missing in a row is left empty."""
    text = io.StringIO()
    writer = csv.DictWriter(
        text, fieldnames=list(dict.fromkeys(key for row in rows for key in row)), lineterminator="\n"
    )
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
