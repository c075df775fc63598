"""Load a `RigConfig` from a file and `--set` overrides, and report all problems together."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from lsds.config.backends import backend_issues
from lsds.config.model import RigConfig
from lsds.config.overrides import apply_overrides
from lsds.contracts.kinds import CONFIG_KINDS
from lsds.errors import ConfigError, ConfigIssue
from lsds.plugins.host import PluginHost
from lsds.plugins.options import issues_of


def load_config(
    path: str | Path | None = None,
    overrides: Iterable[str] = (),
    *,
    host: PluginHost | None = None,
    without: Iterable[str] = (),
) -> RigConfig:
    """Return the configuration in a TOML file (None for the defaults), changed by "a.b=value" overrides.

    `host` has the available backends (default: those installed); the config's `plugins.block` is applied to it.
    `without` names sections of the file to ignore. Raises ConfigError with all issues: unreadable file, TOML
    syntax, unknown keys, wrong values, unknown backends, wrong options of any backend that has a table.
    """
    source = str(path) if path is not None else "defaults"
    data = _read(Path(path)) if path is not None else {}
    for section in without:
        data.pop(section, None)
    overrides = tuple(overrides)
    issues = apply_overrides(data, overrides)
    return check_config(data, source + (" with --set" if overrides else ""), host or PluginHost(), issues)


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
        host.block(name for name in blocked if isinstance(name, str))
    found += backend_issues(data, host)
    if config is None or found:
        raise ConfigError(source, found)
    return config


def _is_table_complaint(issue: ConfigIssue, data: dict[str, Any]) -> bool:
    kind, _, key = issue.path.partition(".")
    section = data.get(kind)
    if kind == "sensors" and isinstance(section, dict):
        name, _, key = key.partition(".")
        section = section.get(name)
    elif kind not in CONFIG_KINDS:
        return False
    return isinstance(section, dict) and key not in ("backend", "enabled", "opposite") and key in section


def _read(path: Path) -> dict[str, Any]:
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        remedy = "check the path, or create a config: lsds schema --example > rig.toml"
        raise ConfigError(str(path), [ConfigIssue("file", "does not exist", remedy)]) from None
    except IsADirectoryError:
        raise ConfigError(
            str(path), [ConfigIssue("file", "is a directory", "give the name of the .toml file in it")]
        ) from None
    except OSError as error:
        raise ConfigError(str(path), [ConfigIssue("file", f"cannot be read: {error.strerror}")]) from error
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        issue = ConfigIssue(f"line {line}", f"byte 0x{raw[error.start]:02x} is not UTF-8", "save the file as UTF-8")
        raise ConfigError(str(path), [issue]) from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), [_syntax_issue(text, error)]) from None


def _syntax_issue(text: str, error: tomllib.TOMLDecodeError) -> ConfigIssue:
    """Return the issue for a TOML error such as "Invalid value (at line 3, column 11)", with the line it refers to."""
    problem, _, place = str(error).partition(" (at ")
    place = place.rstrip(")")
    if not place.startswith("line"):
        return ConfigIssue(place or "syntax", problem, "check for an unclosed bracket or quote")
    line = text.splitlines()[int(place.split()[1].rstrip(",")) - 1] if place.split()[1].rstrip(",").isdigit() else ""
    remedy = f"the line reads: {line.strip()}" if line.strip() else ""
    if problem == "Invalid value" and "=" in line:
        remedy += "; text needs quotes, true and false are lower case"
    return ConfigIssue(place, problem, remedy)
