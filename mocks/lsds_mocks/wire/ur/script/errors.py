"""What goes wrong in a script, and where."""

from __future__ import annotations


class ScriptError(Exception):
    """A script cannot be compiled, or failed while it ran. Lines and columns count from one."""

    def __init__(self, text: str, line: int = 0, column: int = 0) -> None:
        super().__init__(text)
        self.text = text
        self.line = line
        self.column = column


class Halt(Exception):
    """The script said `halt`, or something ended it in good order."""
