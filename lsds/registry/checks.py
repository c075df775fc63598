"""Checks of what a manifest declares; each mistake is refused with its remedy."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from lsds.contracts.backend import CONTRACT_VERSION, OLDEST_CONTRACT_VERSION, BackendSpec
from lsds.contracts.kinds import KINDS
from lsds.registry.backends import NO_DEVICE, did_you_mean
from lsds.registry.containment import one_line

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_TARGET = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*:[^\W\d]\w*(\.[^\W\d]\w*)*")
_RESERVED = frozenset({NO_DEVICE, "backend", "enabled"})
_TEXTS = ("kind", "name", "factory", "summary", "extra", "hardware_verified")
_FLAGS = ("virtual_time", "in_cell", "over_wire")


class Refused(Exception):
    """A plugin is refused: the problem, and the remedy."""

    def __init__(self, problem: str, remedy: str) -> None:
        super().__init__(problem)
        self.remedy = remedy


def checked_specs(offered: object) -> list[BackendSpec]:
    """Return a plugin hook's return value as a list of checked specifications. Raises Refused."""
    if not isinstance(offered, Sequence) or isinstance(offered, str | bytes):
        close = getattr(offered, "close", None)
        if close is not None:
            close()  # A coroutine that is never awaited would warn.
        raise Refused(
            f"lsds_backends returned {type(offered).__name__}, expected a list of BackendSpec",
            "write return [BackendSpec(...)]",
        )
    specs: list[BackendSpec] = []
    for item in offered:
        if not isinstance(item, BackendSpec):
            raise Refused(
                f"lsds_backends returned a list with {type(item).__name__} in it, expected BackendSpec",
                "write BackendSpec(kind, name, factory), without quotes or a call of the factory",
            )
        for problem, remedy in _mistakes(item):
            raise Refused(problem, remedy)
        if any((item.kind, item.name) == (other.kind, other.name) for other in specs):
            raise Refused(f"{item.kind} '{item.name}' is offered twice", "give each backend of a kind its own name")
        specs.append(replace(item, requires=tuple(item.requires)))
    return specs


def _mistakes(spec: BackendSpec) -> Iterator[tuple[str, str]]:
    """Yield the problem and remedy of each wrong field; the order matters, as later checks rely on earlier ones."""
    named = f"backend '{one_line(spec.name)}'"
    yield from _contract_mistakes(named, spec.contract)
    for field in _TEXTS:
        if not isinstance(value := getattr(spec, field), str):
            yield f"{named}: {field} is {_shown(value)}, not a text", _quoted(field, value)
    if spec.kind not in KINDS:
        hint = did_you_mean(spec.kind, KINDS)
        yield f"{named} has unknown kind {spec.kind!r}", " ".join(filter(None, (hint, f"kinds: {', '.join(KINDS)}")))
    if not _NAME.fullmatch(spec.name) or spec.name in _RESERVED:
        reserved = ", ".join(f"'{name}'" for name in sorted(_RESERVED))
        yield (
            f"backend name {spec.name!r} is not allowed",
            f"use letters, digits, '.', '_' and '-', and none of {reserved}",
        )
    for field in ("factory", "options"):
        target: Any = getattr(spec, field)
        if target is not None and not (isinstance(target, str) and _TARGET.fullmatch(target)):
            yield (
                f"{named}: {field} {_shown(target)} is not of the form 'module:attribute'",
                f'write {field}="your_package.module:Name"',
            )
    requires: Any = spec.requires
    if isinstance(requires, str):
        yield f"{named}: requires is a text, not a tuple", f'write requires=("{requires}",)'
    elif not isinstance(requires, tuple | list) or not all(isinstance(name, str) and name for name in requires):
        yield f"{named}: requires is {_shown(requires)}, not a tuple of import names", 'write requires=("numpy",)'
    for field in _FLAGS:
        if not isinstance(value := getattr(spec, field), bool):
            yield f"{named}: {field} is {_shown(value)}, not True or False", f"write {field}=True"


def _contract_mistakes(named: str, contract: object) -> Iterator[tuple[str, str]]:
    if not isinstance(contract, int) or isinstance(contract, bool):
        yield f"{named}: contract is {_shown(contract)}, not a whole number", f"write contract={CONTRACT_VERSION}"
    elif contract > CONTRACT_VERSION:
        yield (
            f"{named} needs lsds with contract {contract}; this one has {CONTRACT_VERSION}",
            "upgrade lsds: pip install -U lsds-tactile",
        )
    elif contract < OLDEST_CONTRACT_VERSION:
        yield (
            f"{named} is written for contract {contract}; this lsds supports {OLDEST_CONTRACT_VERSION} and later",
            "upgrade the plugin",
        )


def _quoted(field: str, value: object) -> str:
    if isinstance(value, type) or callable(value):
        return f'write {field}="your_package.module:Name", which is imported when it is used'
    return f'write {field}="..."'


def _shown(value: object) -> str:
    try:
        return one_line(repr(value))
    except Exception:
        return f"a {type(value).__name__}"
