"""The JSON schema (draft 2020-12) of the configuration, with the options of every installed backend."""

from __future__ import annotations

from typing import Any

from lsds.config.model import RigConfig
from lsds.contracts.kinds import CONFIG_KINDS, OPTIONAL_KINDS, Kind
from lsds.errors import PluginError
from lsds.plugins.host import PluginHost
from lsds.plugins.registry import NO_DEVICE, Backend

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema(host: PluginHost | None = None) -> dict[str, Any]:
    """Return the schema, for example for an editor to check a config with.

    A backend whose options cannot be imported gets an unrestricted table, with the reason as its description.
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
                properties[backend.spec.name] = _options(backend, host, definitions)
        section |= {"type": "object", "additionalProperties": False, "properties": properties}
        # A section may hold only options and keep the default backend.
        section["description"] = f"The {kind} backend, and an options table for each backend."
    finger = definitions["FingerSection"]
    finger["properties"] |= schema["properties"]["sensor"]["properties"]
    finger["additionalProperties"] = False
    finger.pop("required", None)
    for unused in ("BackendSection", "ControllerSection"):
        definitions.pop(unused, None)
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
    schema = model.model_json_schema(ref_template=f"#/$defs/{prefix}.{{model}}")
    for name, definition in schema.pop("$defs", {}).items():
        definitions[f"{prefix}.{name}"] = definition
    return schema
