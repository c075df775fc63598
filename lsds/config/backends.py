"""Checks of a configuration against the installed backends: backend names and options tables."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from lsds.config.model import FaultSection, FingerSection, RigConfig
from lsds.contracts.kinds import CONFIG_KINDS, KINDS, OPTIONAL_KINDS, Kind
from lsds.errors import ConfigIssue, PluginConflict, PluginError, PluginNotFound
from lsds.registry.backends import NO_DEVICE, did_you_mean
from lsds.registry.containment import diverted
from lsds.registry.host import PluginHost
from lsds.registry.loading import upgrade_or_block
from lsds.registry.options import table_issues


def backend_issues(data: dict[str, Any], host: PluginHost) -> Iterator[ConfigIssue]:
    """Yield every problem of every section: unknown backends, unknown tables, wrong options."""
    for kind in CONFIG_KINDS:
        if KINDS[kind].late and kind not in data:
            continue
        fields = type(RigConfig.model_fields[kind].default).model_fields
        yield from _section_issues(kind, kind, data.get(kind, {}), tuple(fields), host)
    fingers = data.get("sensors", {})
    if isinstance(fingers, dict):
        for name, section in fingers.items():
            yield from _section_issues("sensor", f"sensors.{name}", section, tuple(FingerSection.model_fields), host)
    faults = data.get("faults", ())
    for at, fault in enumerate(faults if isinstance(faults, list | tuple) else ()):
        yield from _fault_issues(f"faults.{at}", fault, host)


def _fault_issues(path: str, fault: object, host: PluginHost) -> Iterator[ConfigIssue]:
    """Yield the problems of a table of `[[faults]]`; its keys but two are options of the fault."""
    if not isinstance(fault, dict) or not isinstance(fault.get("backend"), str):
        return  # The model has already reported this.
    own = {key: value for key, value in fault.items() if key not in FaultSection.model_fields}
    yield from _choice_issues("fault", path, fault["backend"], host)
    for issue in _table_issues("fault", path, fault["backend"], own, fault["backend"], host, ()):
        yield replace(issue, path=issue.path.replace(f"{path}.{fault['backend']}", path, 1))


def _section_issues(
    kind: Kind, path: str, section: object, fields: tuple[str, ...], host: PluginHost
) -> Iterator[ConfigIssue]:
    if not isinstance(section, dict):
        return  # The model has already reported this.
    chosen = section.get("backend", host.own(kind, KINDS[kind].default))
    if isinstance(chosen, str):
        yield from _choice_issues(kind, path, chosen, host)
    for name, table in section.items():
        if name not in fields:
            yield from _table_issues(kind, path, name, table, chosen, host, fields)
    if isinstance(chosen, str) and not {chosen, chosen.rpartition(":")[2]} & set(section):
        yield from _table_issues(kind, path, chosen, {}, chosen, host, ())


def _choice_issues(kind: Kind, path: str, chosen: str, host: PluginHost) -> Iterator[ConfigIssue]:
    if chosen == NO_DEVICE:
        if kind == "fault":
            yield ConfigIssue(f"{path}.backend", "'none' is no fault", "leave the table out")
        elif kind not in OPTIONAL_KINDS:
            yield ConfigIssue(f"{path}.backend", f"a rig needs a {kind}")
        return
    try:
        host.find(kind, chosen)
    except PluginNotFound as error:
        yield ConfigIssue(f"{path}.backend", f"unknown backend '{chosen}'", _remedy(kind, chosen, host, error))
    except PluginConflict as error:
        yield ConfigIssue(f"{path}.backend", str(error))


def _table_issues(
    kind: Kind, section: str, name: str, table: Any, chosen: object, host: PluginHost, fields: tuple[str, ...]
) -> Iterator[ConfigIssue]:
    path = f"{section}.{name}"
    if name == NO_DEVICE:
        return
    if not isinstance(table, dict):
        known = [*fields, *host.names(kind)]
        remedy = did_you_mean(name, known) or f"options of a backend belong in its own table, [{section}.{chosen}]"
        yield ConfigIssue(path, "unknown key", remedy)
        return
    try:
        backend = host.find(kind, _qualified(name, chosen))
    except PluginConflict as error:
        if name != chosen:
            yield ConfigIssue(path, str(error))
        return
    except PluginError:
        if name != chosen:
            yield ConfigIssue(path, "no installed backend has that name", _remedy(kind, name, host, None))
        return
    try:
        model = host.options_model(backend)
    except PluginError as error:
        # Missing libraries of a backend that is not chosen do not affect this run.
        if name in (chosen, str(chosen).rpartition(":")[2]):
            yield ConfigIssue(path, str(error))
        return
    if model is None:
        for key in table:
            yield ConfigIssue(f"{path}.{key}", "this backend takes no options")
        return
    with diverted():  # A validator is code of the plugin.
        issues = table_issues(model, table, path, upgrade_or_block(backend.plugin, backend.distribution))
    yield from issues


def _qualified(name: str, chosen: object) -> str:
    """Return the backend that the table `[kind.name]` belongs to; if two plugins offer the name, the chosen one."""
    return chosen if isinstance(chosen, str) and chosen.rpartition(":")[2] == name else name


def _remedy(kind: Kind, name: str, host: PluginHost, error: PluginNotFound | None) -> str:
    known = host.names(kind)
    parts = [did_you_mean(name, known), f"installed: {', '.join(known) or 'none'}"]
    parts += [f"plugin {failure}" for failure in host.failures]
    return "; ".join(part for part in parts if part)
