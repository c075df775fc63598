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
_DECLARATIONS = ("may_open", "limits_force")
"""Members that count as false where a controller does not have them."""


def check_contract(backend: str, kind: Kind, built: object, remedy: str = "") -> None:
    """Raise ContractMismatch with every member that is missing or cannot be called as in the contract."""
    if (nothing := _not_an_object(kind, built)) is not None:
        raise ContractMismatch(f"{backend}: its factory {nothing}")
    problems = list(_problems(KINDS[kind].contract, built))
    if problems:
        raise ContractMismatch(
            f"{backend}: {type(built).__name__} does not fulfil the contract of a {kind}: {'; '.join(problems)}"
            + (f" ({remedy})" if remedy else "")
        )


def contract_members(kind: Kind) -> tuple[str, ...]:
    """Return the members of a kind's contract as they are written, such as "command(command)" and "spec"."""
    return tuple(
        name if isinstance(member, property) else f"{name}({', '.join(_parameters(member))})"
        for name, member in _members(KINDS[kind].contract)
        if isinstance(member, property) or callable(member)
    )


def _not_an_object(kind: Kind, built: object) -> str | None:
    if built is None:
        return f"returned None; return the {kind} that it makes"
    if inspect.iscoroutine(built):
        built.close()
        return f"is async; write def instead of async def, and return the {kind}"
    if isinstance(built, type):
        return f"returned the class {built.__name__}; return an object of it"
    return None


def _problems(protocol: type, built: object) -> Iterator[str]:
    for name, wanted in _members(protocol):
        if name in _DECLARATIONS:
            continue
        if isinstance(wanted, property):
            if inspect.getattr_static(built, name, _MISSING) is _MISSING and not _has(built, name):
                yield f"{name} is missing"
            continue
        try:
            member = getattr(built, name, _MISSING)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            yield f"{name} raises {type(error).__name__}"
            continue
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
    except KeyboardInterrupt:
        raise
    except BaseException:
        return True
    return True


def _parameters(wanted: Any) -> list[str]:
    return list(inspect.signature(wanted).parameters)[1:]


def _arity_complaint(member: Any, wanted: Any) -> str | None:
    parameters = _parameters(wanted)
    try:
        signature = inspect.signature(member)
    except (TypeError, ValueError):
        return None
    try:
        signature.bind(*(None for _ in parameters))
    except TypeError as error:
        return f"cannot be called as ({', '.join(parameters)}): {error}"
    return None
