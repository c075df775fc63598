"""The help of every command fits a terminal, and states how long the command takes and what it writes."""

from __future__ import annotations

import click
import pytest

from lsds.cli.main import cli
from tests.docs.command_tree import commands

WIDTH = 80
"""Columns of the narrowest terminal that help is written for."""
PAGES = {" ".join(path): (path, command) for path, command in commands(cli, ("lsds",))}
DOING = [name for name, (_, command) in PAGES.items() if not isinstance(command, click.Group) or name == "lsds plugins"]
"""Commands that do something; the others are groups, which only list their commands."""


def page(name):
    path, command = PAGES[name]
    context = None
    for word in path[:-1]:
        context = click.Context(cli, info_name=word, parent=context)
    return command.get_help(click.Context(command, info_name=path[-1], parent=context, terminal_width=WIDTH))


def test_the_walk_reaches_every_level():
    assert {"lsds", "lsds run", "lsds record export", "lsds study gel", "lsds mock plant", "lsds learn train"} <= set(
        PAGES
    )
    assert len(PAGES) > 55


@pytest.mark.parametrize("name", PAGES)
def test_no_line_of_help_is_wider_than_the_terminal(name):
    assert [line for line in page(name).splitlines() if len(line) > WIDTH] == []


@pytest.mark.parametrize("name", DOING)
@pytest.mark.parametrize("label", ["Takes: ", "Writes: "])
def test_help_states_the_duration_and_what_is_written(name, label):
    assert [line for line in page(name).splitlines() if line.startswith(f"  {label}")], f"no paragraph '{label}'"
