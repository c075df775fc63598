"""Errors of a script, with their position."""

from __future__ import annotations


class ScriptError(Exception):
    """A script cannot be compiled, or failed at run time. Lines and columns count from one."""

    def __init__(self, text: str, line: int = 0, column: int = 0) -> None:
        super().__init__(text)
        self.text = text
        self.line = line
        self.column = column


class Halt(Exception):
    """The script called `halt`, or was ended regularly."""
