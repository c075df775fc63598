"""Contract of a command that a plugin adds to the `lsds` command line."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable


@runtime_checkable
class Command(Protocol):
    """The object named by the factory of a backend of kind `command`: a `click.Command` or group."""

    def make_context(self, info_name: str, args: list[str]) -> Any:
        """Parse the arguments. Raises click.UsageError."""
        ...

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        ...
