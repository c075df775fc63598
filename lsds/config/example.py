"""An example config: every key with its default and a comment, including the options of the chosen backends."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from lsds.config import toml
from lsds.config.model import RigConfig
from lsds.config.own import with_own_backends
from lsds.contracts.kinds import CONFIG_KINDS, KINDS, Kind
from lsds.registry.host import PluginHost


def example_config(config: RigConfig | None = None, host: PluginHost | None = None) -> str:
    """Return a configuration (the default one) as TOML with a comment on every key that has a description.

    Options of a chosen backend that are not set are written with their defaults if the backend is installed.
    """
    host = host or PluginHost()
    dumped = with_own_backends(config or RigConfig(), host).as_tables()
    # The backends come before their options.
    data = {key: dumped[key] for key in sorted(dumped, key=_rank)}
    models: dict[tuple[str, ...], type[BaseModel]] = {}
    for kind in CONFIG_KINDS:
        if KINDS[kind].late and not host.names(kind):
            del data[kind]
        elif kind in data:
            _show_options(kind, data[kind], host, models)

    def comment(path: tuple[str, ...]) -> str:
        if len(path) == 1 and path[0] in CONFIG_KINDS:
            return _section_comment(path[0], host)
        if path[:2] in models:
            return _description(models[path[:2]], path[2:])
        return _description(RigConfig, path)

    return toml.dumps(data, comment)


def _rank(key: str) -> int:
    """Return plain values first, then the sections of backends, then other tables, each in its own order."""
    if key in ("seed", "clock"):
        return 0
    return 1 if key in (*CONFIG_KINDS, "sensors") else 2


def _show_options(kind: Kind, section: dict[str, Any], host: PluginHost, models: dict[Any, type[BaseModel]]) -> None:
    name = section["backend"].rpartition(":")[2]
    try:
        model = host.options_model(host.find(kind, section["backend"]))
        if model is None:
            return
        section[name] = model.model_validate(section.get(name, {})).model_dump(mode="json")
    except Exception:
        return  # Broken, not installed, or with options that have no default: the user has to write this table.
    models[kind, name] = model


def _section_comment(kind: Kind, host: PluginHost) -> str:
    installed = ", ".join(host.names(kind))
    return KINDS[kind].purpose + (f"; installed: {installed}" if installed else "")


def _description(model: type[BaseModel], path: tuple[str, ...]) -> str:
    """Return the description of a key, following nested models; for a table the first line of its docstring."""
    for depth, part in enumerate(path):
        field = model.model_fields.get(part)
        if field is None:
            return ""
        nested = field.annotation if isinstance(field.annotation, type) else type(None)
        if not issubclass(nested, BaseModel):
            return _one_line(field.description) if depth == len(path) - 1 else ""
        model = nested
    return _one_line(model.__doc__)


def _one_line(text: str | None) -> str:
    return (text or "").strip().split("\n\n")[0].replace("\n", " ").strip()
