"""The JSON schema (draft 2020-12) of the configuration, with the options of every installed backend."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from lsds.config.model import RigConfig
from lsds.config.reading import EDITORS_KEY
from lsds.contracts.kinds import CONFIG_KINDS, OPTIONAL_KINDS, Kind
from lsds.errors import PluginError
from lsds.registry.backends import NO_DEVICE, Backend
from lsds.registry.containment import one_line
from lsds.registry.host import PluginHost
from lsds.registry.loading import upgrade_or_block

if TYPE_CHECKING:
    from pydantic import BaseModel

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema(host: PluginHost | None = None) -> dict[str, Any]:
    """Return the schema, for example for an editor to check a config with.

    A backend whose options cannot be imported, or have no schema, gets an unrestricted table, with the reason as its
    description.
    """
    host = host or PluginHost()
    schema = RigConfig.model_json_schema()
    definitions = schema.setdefault("$defs", {})
    for kind in CONFIG_KINDS:
        section = schema["properties"][kind]
        base = definitions[section.pop("$ref").rpartition("/")[2]]
        properties = {**base["properties"], "backend": {"type": "string", "enum": _names(kind, host)}}
        for backend in host.backends:
            if backend.spec.kind == kind:
                name, table = backend.spec.name, _options(backend, host, definitions)
                # The table of a name that two plugins offer belongs to whichever the config chooses.
                properties[name] = {"anyOf": [properties[name], table]} if name in properties else table
        section |= {"type": "object", "additionalProperties": False, "properties": properties}
        # A section may hold only options and keep the default backend.
        section["description"] = f"The {kind} backend, and an options table for each backend."
    finger = definitions["FingerSection"]
    finger["properties"] |= schema["properties"]["sensor"]["properties"]
    finger["additionalProperties"] = False
    finger.pop("required", None)
    for unused in ("BackendSection", "ControllerSection"):
        definitions.pop(unused, None)
    own_name = {"type": "string", "description": "the schema that an editor checks this file with"}
    schema["properties"][EDITORS_KEY] = own_name
    # One finger or several, never both; and every finger has a name.
    schema["not"] = {"required": ["sensor", "sensors"], "properties": {"sensors": {"minProperties": 1}}}
    schema["properties"]["sensors"]["propertyNames"] = {"minLength": 1}
    return {"$schema": DIALECT, **schema}


def _names(kind: Kind, host: PluginHost) -> list[str]:
    names = [NO_DEVICE] if kind in OPTIONAL_KINDS else []
    for backend in host.backends:
        if backend.spec.kind == kind:
            names += [backend.spec.name, backend.qualified_name]
    return list(dict.fromkeys(names))


def _options(backend: Backend, host: PluginHost, definitions: dict[str, Any]) -> dict[str, Any]:
    try:
        model = host.options_model(backend)
    except PluginError as error:
        return {"type": "object", "description": str(error)}
    if model is None:
        return {"type": "object", "additionalProperties": False, "description": backend.spec.summary}
    # Two plugins may each have a model named Options, so every definition includes the name of its backend.
    prefix = f"{backend.spec.kind}.{backend.distribution}.{backend.spec.name}"
    try:
        schema = host.contained(
            backend, "building its schema", lambda: _schema_of(model, f"#/$defs/{prefix}.{{model}}")
        )
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        reason = f"its options have no JSON schema: {type(error).__name__}: {one_line(error)}"
        remedy = upgrade_or_block(backend.plugin, backend.distribution)
        return {"type": "object", "description": f"{backend}: {reason}; {remedy}"}
    for name, definition in schema.pop("$defs", {}).items():
        definitions[f"{prefix}.{name}"] = definition
    table: dict[str, Any] = schema
    return table


def _schema_of(model: type[BaseModel], template: str) -> dict[str, Any]:
    """Return a model's schema as plain JSON. Raises whatever the model raises, TypeError if it is not JSON."""
    schema = json.loads(json.dumps(model.model_json_schema(ref_template=template)))
    if not isinstance(schema, dict):
        raise TypeError(f"it is {type(schema).__name__}, not a table")
    return schema
