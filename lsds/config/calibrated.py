"""Files of calibration that a config names: options of backends, which count below the config's own.

    calibration = ["slip.toml"]      # at the top of rig.toml; lsds calibrate slip writes such a file

A file holds tables such as `[detector.fused]`, and `[tactile]` and `[grip]`, and nothing else: what is learnt on a cell
changes no choice of backend.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.config.backends import backend_issues
from lsds.config.reading import read_toml
from lsds.contracts.kinds import CONFIG_KINDS
from lsds.errors import ConfigError, ConfigIssue

if TYPE_CHECKING:
    from lsds.registry.host import PluginHost

KEY = "calibration"
PLAIN = ("tactile", "grip")
"""The tables that hold options, not backends."""


def with_calibration(data: dict[str, Any], folder: Path, source: str, host: PluginHost) -> None:
    """Fill in what the config's files of calibration say and the config itself does not; later files count more.

    `folder` is that of the config `source`, from which relative names count. Raises ConfigError that names a file.
    """
    names = data.get(KEY, [])
    if not isinstance(names, list | tuple) or not all(isinstance(n, str) for n in names):
        return  # The model says so.
    paths = calibration_paths(names, folder)
    if missing := [_missing(path) for path in paths if not path.exists()]:
        raise ConfigError(source, missing)
    for path in reversed(paths):
        tables = read_toml(path)
        plain = {name: tables.pop(name) for name in PLAIN if name in tables}
        issues = [*_misplaced(tables), *backend_issues(tables, host)]
        if issues:
            raise ConfigError(str(path), issues)
        _fill(data, plain)
        for kind, backends in tables.items():
            section = data.setdefault(kind, {})
            if isinstance(section, dict):
                _fill(section, backends)


def calibration_paths(names: Iterable[str], folder: Path) -> list[Path]:
    """Return the files of names that count from a config's folder."""
    return [folder / Path(name).expanduser() for name in names]


def _missing(path: Path) -> ConfigIssue:
    problem = f"{path.name} does not exist in the folder {path.parent.resolve()}"
    return ConfigIssue(KEY, problem, "paths count from the config's folder; lsds calibrate slip writes such a file")


def _misplaced(tables: dict[str, Any]) -> Iterator[ConfigIssue]:
    for kind, section in tables.items():
        if kind not in CONFIG_KINDS:
            remedy = f"tables like [detector.fused], [tactile] or [grip]; kinds are {', '.join(CONFIG_KINDS)}"
            yield ConfigIssue(kind, "does not belong into a file of calibration", remedy)
        elif not isinstance(section, dict) or not all(isinstance(table, dict) for table in section.values()):
            yield ConfigIssue(kind, "holds something else than tables of options", "choose backends in the config")


def _fill(section: dict[str, Any], backends: dict[str, Any]) -> None:
    for name, options in backends.items():
        table = section.setdefault(name, {})
        if isinstance(table, dict):
            for key, value in options.items():
                table.setdefault(key, value)
