"""Backends that a program registers itself, without packaging them: for notebooks, scripts and tests.

A backend is named "lsds.registry.in_program:KIND/NAME", which is resolved by this module's `__getattr__`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from lsds.contracts.backend import BackendSpec
from lsds.contracts.kinds import KINDS, Kind
from lsds.errors import PluginError

if TYPE_CHECKING:
    from pydantic import BaseModel

DISTRIBUTION = "program"
"""Stands for the distribution of what a program registers: "program:mine" in a config."""
_SPECS: dict[tuple[str, str], BackendSpec] = {}
_OBJECTS: dict[str, Any] = {}


def register(
    kind: Kind, name: str, make: Callable[..., Any], options: type[BaseModel] | None = None, **more: Any
) -> None:
    """Offer a backend to all rigs of this process; one of the same kind and name is replaced.

    `make` is a class or a function: called without arguments, or with (options, context) if it takes two; `options` is
    the pydantic model of its table. `more` are fields of `BackendSpec`, such as `virtual_time`. Raises PluginError.
    """
    if kind not in KINDS:
        raise PluginError(f"no kind '{kind}' of backends (there are {', '.join(KINDS)})")
    if not callable(make):
        raise PluginError(f"{kind} '{name}': {make!r} cannot be called (give the class, or a function that builds it)")
    if not name or ":" in name or "." in name:
        raise PluginError(f"{kind}: '{name}' cannot be a name (no colon, no dot)")
    key = f"{kind}/{name}"
    _OBJECTS[key] = _factory(make)
    _OBJECTS[f"{key}/options"] = options
    model = None if options is None else f"{__name__}:{key}/options"
    _SPECS[kind, name] = BackendSpec(kind, name, f"{__name__}:{key}", model, "registered by this program", **more)


def unregister(kind: Kind, name: str) -> None:
    """Withdraw a backend; do nothing if it is not registered."""
    _SPECS.pop((kind, name), None)
    _OBJECTS.pop(f"{kind}/{name}", None)
    _OBJECTS.pop(f"{kind}/{name}/options", None)


def specs() -> tuple[BackendSpec, ...]:
    """Return the backends that are registered now."""
    return tuple(_SPECS.values())


def _factory(make: Callable[..., Any]) -> Callable[[Any, Any], Any]:
    """Return a factory of (options, context) for a class or function that may take neither."""
    try:
        inspect.signature(make).bind()
    except TypeError:
        return make
    except ValueError:
        pass  # A builtin without a signature.
    return lambda options, context: make()


def __getattr__(name: str) -> Any:
    try:
        return _OBJECTS[name]
    except KeyError:
        raise AttributeError(f"this program registers no {name}") from None
