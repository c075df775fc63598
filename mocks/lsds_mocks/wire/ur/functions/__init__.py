"""The controller's functions for scripts. Functions that take time are generators that yield once per cycle.

A script that calls a function outside these modules gets the controller's error "name not found".
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

from lsds_mocks.wire.ur.functions import communication, mathematics, motion, robot, sockets

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.controller import Controller

_MODULES = (motion, robot, communication, sockets)


class Library:
    """All functions for one program, bound to its controller. `close` closes everything that the program has opened.

    `ports` are those to which the program may open a socket.
    """

    def __init__(self, controller: Controller, ports: frozenset[int] = frozenset()) -> None:
        self.functions: dict[str, Callable[..., Any]]
        self.functions = mathematics.functions(controller.work, controller.operations)
        for module in (motion, robot, communication):
            self._bind(module.Functions(controller))
        self._sockets = sockets.Functions(controller, ports)
        self._bind(self._sockets)

    def _bind(self, part: object) -> None:
        self.functions |= {name: getattr(part, name) for name in _public(type(part))}

    def close(self) -> None:
        """Close the program's sockets, so that the peers detect its end."""
        self._sockets.close_all()


@cache
def waiting() -> dict[str, bool]:
    """Return the names of all functions, with True for those that take time."""
    found = dict.fromkeys(mathematics.NAMES, False)
    for module in _MODULES:
        for name in _public(module.Functions):
            found[name] = inspect.isgeneratorfunction(getattr(module.Functions, name))
    return found


def _public(cls: type) -> list[str]:
    return [name for name in vars(cls) if not name.startswith("_") and name != "close_all"]
