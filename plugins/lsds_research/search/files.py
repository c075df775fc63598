"""A scenario as a file that `lsds run FILE` runs again, bit by bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lsds.config import load_config
from lsds.config.toml import dumps
from lsds.errors import DataError
from lsds_research.search.robustness import overrides_of
from lsds_research.search.space import Scenario


def save_scenario(folder: Path, name: str, scenario: Scenario, settings: tuple[str, ...], told: list[str]) -> Path:
    """Write a scenario; return its file. `told` are lines of comment. Raises DataError where it cannot be written."""
    tables: dict[str, Any] = {}
    for override in [*overrides_of(scenario), *settings]:
        # Through the config's own reader, so that what is written is what was run.
        key = override.partition("=")[0]
        value: Any = load_config(None, [override]).as_tables()
        *above, last = key.split(".")
        table = tables
        for part in above:
            value, table = value[part], table.setdefault(part, {})
        table[last] = value[last]
    text = "".join(f"# {line}\n" for line in told) + dumps(tables)
    path = folder / f"{name}.toml"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise DataError(f"{path}: cannot be written: {error}") from error
    return path
