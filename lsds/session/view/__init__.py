"""Live views of a run: observers of the engine's events that draw them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from lsds.errors import DataError

if TYPE_CHECKING:
    from lsds.contracts.events import Published

TERMINAL, RERUN, REMOTE, FILE = "terminal", "rerun", "rerun+http://", ".rrd"


class View(Protocol):
    """An observer of `Engine.events`."""

    def observe(self, event: Published) -> None:
        """Draw an event."""
        ...

    def close(self) -> None:
        """End the view."""
        ...


def view_of(where: str) -> View:
    """Return a view: "terminal"; "rerun" starts Rerun's viewer, "rerun+http://HOST:PORT/proxy" connects to one, and
    "F.rrd" writes a file for it.

    Raises DataError for another text or an existing file, MissingExtra without Rerun.
    """
    if where == TERMINAL:
        from lsds.session.view.terminal import TerminalView

        return TerminalView()
    if where == RERUN or where.startswith(REMOTE) or where.endswith(FILE):
        from lsds.session.view.rerun import RerunView

        return RerunView(where)
    raise DataError(f"no view '{where}': choose {TERMINAL}, {RERUN}, {REMOTE}HOST:PORT/proxy or a new file F{FILE}")
