"""Check that the object returned by a factory has the members of its kind's contract.

Properties are looked up without being evaluated, because reading `spec` may need a connected device.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

from lsds.contracts.kinds import KINDS, Kind
from lsds.errors import ContractMismatch

_MISSING = object()


def check_contract(backend: str, kind: Kind, built: object) -> None:
    """Raise ContractMismatch with every member that is missing or cannot be called as in the contract."""
    problems = list(_problems(KINDS[kind].contract, built))
    if problems:
        raise ContractMismatch(
            f"{backend}: {type(built).__name__} does not fulfil the contract of a {kind}: {'; '.join(problems)}"
        )


def _problems(protocol: type, built: object) -> Iterator[str]:
    for name, wanted in _members(protocol):
        if isinstance(wanted, property):
            if inspect.getattr_static(built, name, _MISSING) is _MISSING and not _has(built, name):
                yield f"{name} is missing"
            continue
        member = getattr(built, name, _MISSING)
        if member is _MISSING:
            yield f"{name}() is missing"
        elif not callable(member):
            yield f"{name} is {type(member).__name__}, not a method"
        elif inspect.iscoroutinefunction(member) or inspect.isasyncgenfunction(member):
            yield f"{name}() is async, the contract is synchronous"
        elif (complaint := _arity_complaint(member, wanted)) is not None:
            yield f"{name}() {complaint}"


def _members(protocol: type) -> Iterator[tuple[str, Any]]:
    seen: set[str] = set()
    for base in protocol.__mro__:
        if base.__module__.startswith("lsds."):
            for name, member in vars(base).items():
                if not name.startswith("_") and name not in seen:
                    seen.add(name)
                    yield name, member


def _has(built: object, name: str) -> bool:
    """Return whether a proxy with `__getattr__` has the member; a getter that raises another error counts as
    present."""
    try:
        getattr(built, name)
    except AttributeError:
        return False
    except Exception:
        return True
    return True


def _arity_complaint(member: Any, wanted: Any) -> str | None:
    parameters = list(inspect.signature(wanted).parameters.values())[1:]
    try:
        signature = inspect.signature(member)
    except (TypeError, ValueError):
        return None
    try:
        signature.bind(*(None for _ in parameters))
    except TypeError as error:
        names = ", ".join(parameter.name for parameter in parameters)
        return f"cannot be called as ({names}): {error}"
    return None
