"""Backends that a configuration does not name are those of lsds, even if a plugin claims their names."""

from __future__ import annotations

from typing import Any

from lsds.config.model import BackendSection, RigConfig
from lsds.contracts.kinds import CONFIG_KINDS, Kind
from lsds.registry.host import PluginHost


def with_own_backends(config: RigConfig, host: PluginHost) -> RigConfig:
    """Return the configuration with "lsds:name" for each default backend whose name another plugin claims too."""
    changed: dict[str, Any] = {}
    for kind in CONFIG_KINDS:
        section: BackendSection = getattr(config, kind)
        if (own := _own(section, kind, host)) is not section:
            changed[kind] = own
    sensors = {name: _own(finger, "sensor", host) for name, finger in config.sensors.items()}
    if any(sensors[name] is not finger for name, finger in config.sensors.items()):
        changed["sensors"] = sensors
    return config.model_copy(update=changed) if changed else config


def own_section(name: str, options: dict[str, Any] | None = None) -> BackendSection:
    """Return a section with a backend that lsds, not the user, chooses by name."""
    section = BackendSection.model_validate({"backend": name} | ({} if options is None else {name: options}))
    section.model_fields_set.discard("backend")
    return section


def _own(section: BackendSection, kind: Kind, host: PluginHost) -> Any:
    if not section.by_default or not section.chosen:
        return section
    name = host.own(kind, section.backend)
    return section if name == section.backend else section.model_copy(update={"backend": name})
