"""A scenario as a file that `lsds run FILE` reproduces exactly."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lsds.config.overrides import apply_overrides, override_texts
from lsds.config.toml import dumps
from lsds.errors import ConfigError, DataError
from lsds_research.search.space import Scenario


def save_scenario(folder: Path, name: str, scenario: Scenario, settings: tuple[str, ...], comments: list[str]) -> Path:
    """Write a scenario with lines of `comments`; return its file. Raises DataError if it cannot be written."""
    tables: dict[str, Any] = {}
    if issues := apply_overrides(tables, (*override_texts(scenario), *settings)):
        raise ConfigError("the scenario", issues)
    text = "".join(f"# {line}\n" for line in comments) + dumps(tables)
    path = folder / f"{name}.toml"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise DataError(f"{path}: cannot be written: {error} (choose another folder)") from error
    return path
