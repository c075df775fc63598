"""Describe a backend: what it needs, the members of its contract, and its options with types, defaults and units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from lsds.contracts.kinds import KINDS
from lsds.errors import PluginError
from lsds.registry.containment import one_line
from lsds.registry.contract import contract_members

if TYPE_CHECKING:
    from pydantic import BaseModel

    from lsds.registry.backends import Backend
    from lsds.registry.host import PluginHost

_UNITS = {
    "hz": "Hz",
    "n": "N",
    "nm": "Nm",
    "pa": "Pa",
    "kpa": "kPa",
    "mpa": "MPa",
    "db": "dB",
} | {unit: unit for unit in ("s", "ms", "us", "ns", "m", "mm", "um", "kg", "rad", "deg", "px", "percent")}
"""Ends of names of options, and the units they stand for."""
_COMPOUND = {
    "m_s": "m/s",
    "mm_s": "mm/s",
    "rad_s": "rad/s",
    "deg_s": "deg/s",
    "n_s": "N/s",
    "m_s2": "m/s^2",
    "rad_s2": "rad/s^2",
    "n_m": "N/m",
    "n_mm": "N/mm",
    "kpa_mm": "kPa/mm",
    "deg_s2": "deg/s^2",
    "mm_s2": "mm/s^2",
}
"""Ends of two words, and the units they stand for."""


def described(backend: Backend, host: PluginHost) -> dict[str, Any]:
    """Return a backend as plain values. Options that cannot be imported give `options_problem` and no options."""
    spec = backend.spec
    options: list[dict[str, Any]] = []
    problem = ""
    try:
        model = host.options_model(backend)
        if model is not None:
            options = host.contained(backend, "describing its options", lambda: list(_options(model)))
    except PluginError as error:
        problem = str(error)
    except Exception as error:
        problem = f"{backend}: its options cannot be described: {type(error).__name__}: {one_line(error)}"
    return {
        "kind": spec.kind,
        "name": spec.name,
        "distribution": backend.distribution,
        "plugin": backend.plugin,
        "summary": one_line(spec.summary),
        "purpose": KINDS[spec.kind].purpose,
        "factory": spec.factory,
        "contract": spec.contract,
        "requires": list(spec.requires),
        "missing": list(host.missing_requirements(backend)),
        "extra": spec.extra,
        "virtual_time": spec.virtual_time,
        "hardware_verified": spec.hardware_verified or "not verified",
        "members": list(contract_members(spec.kind)),
        "options": options,
        "options_problem": problem,
    }


def unit_of(name: str, extra: object) -> str:
    """Return the unit of an option: the one that its field names, else the end of its name, else ""."""
    if isinstance(extra, Mapping) and isinstance(extra.get("unit"), str):
        return str(extra["unit"])
    words = name.split("_")
    if len(words) > 2 and "_".join(words[-2:]) in _COMPOUND:
        return _COMPOUND["_".join(words[-2:])]
    if len(words) > 3 and words[-2] == "per" and words[-3] in _UNITS and words[-1] in _UNITS:
        return f"{_UNITS[words[-3]]}/{_UNITS[words[-1]]}"
    return _UNITS.get(words[-1], "") if len(words) > 1 else ""


def _options(model: type[BaseModel], prefix: str = "", above: tuple[type, ...] = ()) -> Iterator[dict[str, Any]]:
    """Yield each option; those of a nested table have dotted names."""
    from pydantic import BaseModel

    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, BaseModel) and kind not in (*above, model):
            yield from _options(kind, f"{prefix}{name}.", (*above, model))
            continue
        required = field.is_required()
        default = None if required else field.get_default(call_default_factory=True, validated_data={})
        yield {
            "name": prefix + name,
            "type": _type_name(kind),
            "default": default,
            "required": required,
            "description": one_line(field.description or ""),
            "unit": unit_of(name, field.json_schema_extra),
        }


def _type_name(kind: Any) -> str:
    """Return a type as it is written, without the modules of its parts."""
    if isinstance(kind, type) and not getattr(kind, "__args__", None):
        return kind.__name__
    return one_line(str(kind).replace("typing.", ""))
