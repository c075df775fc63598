"""The option `--set KEY=VALUE` of the commands that read a config."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from lsds.cli.complete import config_override


def set_option(text: str) -> Callable[[Any], Any]:
    """Return the decorator of a command with the option; `text` is its help."""
    return click.option(
        "--set", "overrides", multiple=True, metavar="KEY=VALUE", shell_complete=config_override, help=text
    )
