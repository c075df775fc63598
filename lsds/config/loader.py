"""Load a `RigConfig` from a file and `--set` overrides, and report all problems together."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from lsds.config.backends import backend_issues
from lsds.config.calibrated import with_calibration
from lsds.config.model import RigConfig
from lsds.config.overrides import apply_overrides
from lsds.config.own import with_own_backends
from lsds.config.reading import EDITORS_KEY, line_of, read_toml, value_at
from lsds.contracts.kinds import CONFIG_KINDS
from lsds.errors import ConfigError, ConfigIssue
from lsds.registry.host import PluginHost
from lsds.registry.options import issues_of


def load_config(
    path: str | Path | None = None,
    overrides: str | Iterable[str] = (),
    *,
    host: PluginHost | None = None,
    without: Iterable[str] = (),
) -> RigConfig:
    """Return the configuration in a TOML file (None for the defaults), changed by one or several "a.b=value".

    `host` has the available backends (default: those installed); the config's `plugins.block` is applied to it.
    `without` names sections of the file to ignore. Raises ConfigError with all issues: unreadable file, TOML
    syntax, unknown keys, wrong values, unknown backends, wrong options of any backend that has a table.
    """
    source = str(path) if path is not None else "defaults"
    data = read_toml(Path(path)) if path is not None else {}
    if isinstance(data.get(EDITORS_KEY), str):
        # For editors only: the schema that they check the file with.
        del data[EDITORS_KEY]
    for section in without:
        data.pop(section, None)
    overrides = (overrides,) if isinstance(overrides, str) else tuple(overrides)
    issues = apply_overrides(data, overrides)
    host = host or PluginHost()
    source += " with --set" if overrides else ""
    with_calibration(data, Path(path).parent if path is not None else Path(), source, host)
    try:
        return check_config(data, source, host, issues)
    except ConfigError as error:
        if path is None or not Path(path).is_file():
            raise
        text = Path(path).read_bytes().decode("utf-8-sig")
        own = tomllib.loads(text)
        raise ConfigError(source, [_located(issue, text, own, data) for issue in error.issues]) from None


def _located(issue: ConfigIssue, text: str, own: dict[str, Any], data: dict[str, Any]) -> ConfigIssue:
    """Return an issue with its line if the value is the file's `own`; an override or a calibration has none."""
    value = value_at(own, issue.path)
    same = value is not None and repr(value) == repr(value_at(data, issue.path))
    return replace(issue, line=line_of(text, issue.path) if same else None)


def check_config(data: dict[str, Any], source: str, host: PluginHost, issues: Iterable[ConfigIssue] = ()) -> RigConfig:
    """Return parsed TOML as a configuration. Raises ConfigError with all issues, the given ones first."""
    found = list(issues)
    config = None
    try:
        config = RigConfig.model_validate(data)
    except ValidationError as error:
        # A value in a backend section that is not a table gets a better message below.
        found += [issue for issue in issues_of(error, RigConfig) if not _is_table_complaint(issue, data)]
    blocked = data.get("plugins", {}).get("block", ()) if isinstance(data.get("plugins", {}), dict) else ()
    if isinstance(blocked, list | tuple):
        names = [name for name in blocked if isinstance(name, str)]
        host.block(names)
        found += _block_issues(names, host)
    found += backend_issues(data, host)
    if config is None or found:
        raise ConfigError(source, found)
    return with_own_backends(config, host)


def _block_issues(names: Iterable[str], host: PluginHost) -> list[ConfigIssue]:
    """Return an issue for each name that looks like a misspelt plugin; others may be installed on another computer."""
    unknown = host.unknown_blocks()
    return [
        ConfigIssue("plugins.block", f"'{name}' is not installed", unknown[name]) for name in names if unknown.get(name)
    ]


def _is_table_complaint(issue: ConfigIssue, data: dict[str, Any]) -> bool:
    kind, _, key = issue.path.partition(".")
    section = data.get(kind)
    if kind == "sensors" and isinstance(section, dict):
        name, _, key = key.partition(".")
        section = section.get(name)
    elif kind not in CONFIG_KINDS:
        return False
    return isinstance(section, dict) and key not in ("backend", "enabled", "opposite") and key in section
