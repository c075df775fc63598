"""Shows the help of a command in a separate process, and prints which of the named libraries that imports.

Run as `python -m lsds.testing.help_probe MODULE:ATTRIBUTE LIBRARY...`.
"""

from __future__ import annotations

import importlib
import io
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout, suppress

import click

FOUND = "imported:"
"""Beginning of the line that names the libraries; the command may print others."""


def imported_by_help(target: str, libraries: Sequence[str]) -> list[str]:
    """Return which libraries the import of a command and its help import. Raises what the import raises."""
    before = set(sys.modules)
    module, _, attribute = target.partition(":")
    command = importlib.import_module(module)
    for part in attribute.split("."):
        command = getattr(command, part)
    with redirect_stdout(io.StringIO()), suppress(click.exceptions.Exit):
        command.make_context("lsds", ["--help"])
    imported = {name.partition(".")[0] for name in set(sys.modules) - before}
    return sorted(imported.intersection(libraries))


if __name__ == "__main__":
    print(FOUND, *imported_by_help(sys.argv[1], sys.argv[2:]))
