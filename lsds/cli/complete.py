"""Values that the shell completes: config keys, backends, faults, objects.

Each function has the form that click calls. Nothing is imported before Tab asks for it. A key is completed table by
table, as a shell completes a path.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import click

from lsds.cli.plugged import host_of
from lsds.contracts.stages import SLIP, START
from lsds.errors import LsdsError

Completer = Callable[[click.Context, click.Parameter, str], list[str]]
"""A function for `shell_complete` of a click parameter."""

SEVERITIES = range(1, 6)
"""Severities of a fault, mild to severe."""


def config_override(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[str]:
    """Complete KEY=VALUE: the tables and keys of a config, and the values that a key lists."""
    from lsds.config import json_schema

    schema = json_schema(host_of(ctx))
    key, equals, value = incomplete.partition("=")
    *tables, last = key.split(".")
    node = schema
    for name in (*tables, last) if equals else tables:
        node = _resolved(_properties(node, schema).get(name, {}), schema)
    if equals:
        return [f"{key}={word}" for word in _words(node, schema) if word.startswith(value)]
    start = "".join(f"{name}." for name in tables)
    return [
        f"{start}{name}{'.' if _properties(_resolved(child, schema), schema) else '='}"
        for name, child in _properties(node, schema).items()
        if name.startswith(last) and not name.startswith("$")
    ]


def backends(kind: str) -> Completer:
    """Return a function that completes the names of the installed backends of a kind."""

    def complete(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[str]:
        return _starting(host_of(ctx).names(kind), incomplete)

    return complete


def fault_moment(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[str]:
    """Complete NAME[:SEVERITY][@MOMENT]: the installed faults, severities, and the stages of a lift."""
    name, at, moment = incomplete.partition("@")
    if at:
        return [f"{name}@{stage}" for stage in _starting(_moments(ctx), moment)]
    name, colon, severity = incomplete.partition(":")
    if colon:
        return [f"{name}:{number}" for number in SEVERITIES if str(number).startswith(severity)]
    return _starting(host_of(ctx).names("fault"), name)


def simulated_object(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Complete the name of an object of the simulated cell."""
    key = "cell.simulated.object="
    return [found.removeprefix(key) for found in config_override(ctx, parameter, f"{key}{incomplete}")]


def fields(names: Iterable[str]) -> Completer:
    """Return a function that completes KEY= with the names of options."""
    keys = [f"{name}=" for name in names]
    return lambda _, __, incomplete: _starting(keys, incomplete)


BY_FLAG: dict[str, Completer] = {
    "--with": config_override,
    "--object": simulated_object,
    "--fault": backends("fault"),
    "--learner": backends("learner"),
    **{f"--{kind}": backends(kind) for kind in ("tracker", "detector", "estimator", "controller")},
}
"""Completion of the flags that are made from the options of a study."""


def _moments(ctx: click.Context) -> tuple[str, ...]:
    """Return the moments at which a fault can begin in the default job."""
    host = host_of(ctx)
    try:
        stages = getattr(host.imported(host.find("job", host.own("job", "lift"))), "stages", ())
    except LsdsError:
        stages = ()
    return (START, SLIP, *stages)


def _properties(node: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    """Return the keys of a table; those of all alternatives if it has several forms."""
    found = dict(node.get("properties", {}))
    for choice in node.get("anyOf", ()):
        found |= _resolved(choice, schema).get("properties", {})
    return found


def _words(node: dict[str, Any], schema: dict[str, Any]) -> list[str]:
    """Return the values that a key lists, without the qualified names of backends."""
    words = ["true", "false"] if node.get("type") == "boolean" else []
    words += [node["const"]] if "const" in node else node.get("enum", [])
    for choice in node.get("anyOf", ()):
        words += _words(_resolved(choice, schema), schema)
    return [str(word) for word in words if word is not None and ":" not in str(word)]


def _resolved(node: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    """Return a node of the schema, or the definition that it refers to."""
    if "$ref" not in node:
        return node
    found: dict[str, Any] = schema["$defs"].get(str(node["$ref"]).rpartition("/")[2], {})
    return found


def _starting(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
