"""Contract of a command that a plugin adds to the `lsds` command line."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable


@runtime_checkable
class Command(Protocol):
    """What the factory of a backend of kind `command` names: a `click.Command` (or group), ready to use."""

    def make_context(self, info_name: str, args: list[str]) -> Any:
        """Parse the arguments. Raises click.UsageError."""
        ...

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        ...
