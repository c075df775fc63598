"""From a `RigConfig` back to TOML that loads as an equal one."""

from __future__ import annotations

from pydantic import BaseModel

from lsds.config import toml
from lsds.config.model import RigConfig


def dump_config(config: RigConfig) -> str:
    """Return the configuration as TOML. Loading it again gives an equal configuration."""
    return toml.dumps(config.model_dump())


def example_config(config: RigConfig | None = None) -> str:
    """Return a configuration (the default one) as TOML with a comment on every key that has a description."""
    return toml.dumps((config or RigConfig()).model_dump(), comment=_description)


def _description(path: tuple[str, ...]) -> str:
    model: type[BaseModel] = RigConfig
    for part in path[:-1]:
        nested = model.model_fields[part].annotation if part in model.model_fields else None
        if not (isinstance(nested, type) and issubclass(nested, BaseModel)):
            return ""
        model = nested
    field = model.model_fields.get(path[-1])
    if field is None:
        return ""
    if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
        return (field.annotation.__doc__ or "").strip().splitlines()[0]
    return field.description or ""
