"""Write docs/config_keys.md, every key of a config, from the JSON schema: `python docs/config_keys.py`.

The page shows the plugins of this repository only, so that it is the same on every machine. A test compares the stored
page with this script.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

from lsds.config import json_schema, toml
from lsds.contracts.kinds import CONFIG_KINDS, KINDS, Kind
from lsds.registry import PluginHost

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "config_keys.md"
INTRODUCTION = """# Config keys

A config is a TOML file. Every key is optional unless its default is "required". `lsds config example` prints a config
to start from; `lsds config schema` prints the JSON schema of the plugins installed here. An override names a key, too:
`lsds run --set task.lift_s=0.5`.

The page lists the plugins of this repository. `python docs/config_keys.py` writes it from the JSON schema.
`NAME` stands for a name that you choose, `[]` for an entry of a list, and `[a, b]` for a range that includes its ends.
"""


def first_party() -> PluginHost:
    """Return a host of the plugins of this repository, whatever else is installed."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = project["entry-points"]["lsds"]
    return PluginHost(entry_points=[EntryPoint(name, module, "lsds") for name, module in named.items()])


def page(host: PluginHost) -> str:
    """Return the page as Markdown."""
    schema = json_schema(host)
    definitions, sections = schema["$defs"], schema["properties"]
    backends = {kind: sections.pop(kind) for kind in CONFIG_KINDS}
    tables = {key: value for key, value in sections.items() if "$ref" in value}
    plain = {key: value for key, value in sections.items() if key not in tables}

    # The keys of a finger are those of [sensor].
    plain["sensors"] = {**plain["sensors"], "additionalProperties": {}}
    parts = [INTRODUCTION, "## Top level\n", _table(_rows({"properties": plain}, "", definitions))]
    for key, value in tables.items():
        parts += [f"## {key}\n", _table(_rows(_resolved(value, definitions), f"{key}.", definitions))]
    for kind, section in backends.items():
        # Qualified names ("lsds:hand-e") are left out: they only choose between plugins that offer the same name.
        own = {key: value for key, value in section["properties"].items() if key in ("backend", "enabled")}
        own["backend"] = {**own["backend"], "enum": [name for name in own["backend"]["enum"] if ":" not in name]}
        own["backend"]["default"] = section["default"]["backend"]
        own["backend"]["description"] = KINDS[kind].purpose[0].lower() + KINDS[kind].purpose[1:]
        parts += [f"## {kind}\n", _table(_rows({"properties": own}, f"{kind}.", definitions))]
        for name in (name for name in section["properties"] if name not in own):
            rows = _rows(section["properties"][name], f"{kind}.{name}.", definitions)
            parts += [f"### {kind}: {name}\n", _table(rows)]
    parts += [
        "## Wire mocks\n",
        "Options of the mocks that `[cell.wire]` starts; `lsds mock NAME` takes the same ones.\n",
    ]
    for name, options in _options("wire_mock", host):
        rows = _rows(options, f"cell.wire.mocks.{name}.", options.get("$defs", {}))
        parts += [f"### wire mock: {name}\n", _table(rows)]
    parts += ["## Faults\n", "Options next to `backend` and `finger` in a table of `[[faults]]`.\n", _faults(host)]
    return "\n".join(parts)


def _options(kind: Kind, host: PluginHost) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield name and schema of the options of each backend of a kind that a config lists instead of choosing one."""
    for backend in host.backends:
        if backend.spec.kind == kind:
            model = host.options_model(backend)
            yield backend.spec.name, model.model_json_schema() if model else {}


def _faults(host: PluginHost) -> str:
    """Return one table for all faults, because most of them have the same options."""
    faults: dict[tuple[str, ...], list[str]] = {}
    every = dict(_options("fault", host))
    for name, options in every.items():
        for row in _rows(options, "faults[].", options.get("$defs", {})):
            faults.setdefault(row, []).append(f"`{name}`")
    rows = ((*row, "every" if len(names) == len(every) else ", ".join(names)) for row, names in faults.items())
    return _table(rows, ("key", "values", "default", "meaning", "faults"))


def _rows(schema: dict[str, Any], prefix: str, definitions: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield key, values, default and description of each property, and of the tables within."""
    required = schema.get("required", ())
    for name, unresolved in schema.get("properties", {}).items():
        value = _resolved(unresolved, definitions)
        key = prefix + name
        if value.get("properties"):
            yield from _rows(value, f"{key}.", definitions)
            continue
        default = "required" if name in required else _default(value)
        yield f"`{key}`", _values(value, definitions), default, _one_line(value.get("description", ""))
        for choice in (value, *value.get("anyOf", ())):
            yield from _rows(_resolved(choice.get("items", {}), definitions), f"{key}[].", definitions)
            named = choice.get("additionalProperties")
            if isinstance(named, dict):
                yield from _rows(_resolved(named, definitions), f"{key}.NAME.", definitions)


def _resolved(value: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    """Return a schema with its definition merged in; the description next to the reference takes precedence."""
    if "$ref" not in value:
        return value
    return {**definitions[value["$ref"].removeprefix("#/$defs/")], **value}


def _values(value: dict[str, Any], definitions: dict[str, Any]) -> str:
    """Return type and range of a key."""
    if "enum" in value:
        return ", ".join(_code(choice) for choice in value["enum"])
    if "const" in value:
        return _code(value["const"])
    if "anyOf" in value:
        choices = (_resolved(choice, definitions) for choice in value["anyOf"])
        return " or ".join(_values(choice, definitions) for choice in choices if choice.get("type") != "null")
    kind = str(value.get("type", "any"))
    if kind == "array":
        return (
            "list"
            if "items" not in value
            else f"list of {_values(_resolved(value['items'], definitions), definitions)}"
        )
    low, high = value.get("minimum"), value.get("maximum")
    above, below = value.get("exclusiveMinimum"), value.get("exclusiveMaximum")
    name = {"object": "table", "string": "text"}.get(kind, kind)
    if (low, high, above, below) == (None,) * 4:
        return name
    start = f"({above}" if above is not None else f"[{low}" if low is not None else "(−∞"
    end = f"{below})" if below is not None else f"{high}]" if high is not None else "∞)"
    return f"{name} in {start}, {end}"


def _default(value: dict[str, Any]) -> str:
    if value.get("default") is None:
        return "not set"
    return _code(value["default"])


def _code(value: object) -> str:
    """Return a value as TOML."""
    return f"`{toml.value_text(value)}`"


def _one_line(text: str) -> str:
    return " ".join(text.split("\n\n")[0].split()).replace("|", "\\|")


def _table(rows: Iterable[tuple[str, ...]], head: tuple[str, ...] = ("key", "values", "default", "meaning")) -> str:
    lines = [f"| {' | '.join(row)} |" for row in rows]
    if not lines:
        return "No options.\n"
    return "\n".join([f"| {' | '.join(head)} |", "|---" * len(head) + "|", *lines]) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(first_party()), encoding="utf-8")
