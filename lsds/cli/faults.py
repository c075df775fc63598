"""`--fault NAME[:SEVERITY][@MOMENT]`: a table of `[[faults]]`, from the command line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lsds.config.overrides import override_texts
from lsds.errors import ConfigError, ConfigIssue

_FORM = re.compile(r"(?P<name>[^@]+?)(:(?P<severity>0|[1-9]\d*))?(@(?P<moment>.+))?")


def faults_override(faults: Sequence[str], config: Path | None = None) -> list[str]:
    """Return the override that adds faults to those of a config file, none for none.

    Raises ConfigError for a text of another form.
    """
    tables = []
    for text in faults:
        found = _FORM.fullmatch(text)
        if found is None or found["name"].startswith(":"):
            issue = ConfigIssue(
                f"--fault {text}", "is not NAME[:SEVERITY][@MOMENT]", "write --fault camera-noise:5@lift"
            )
            raise ConfigError("the command line", [issue])
        name, severity, moment = found["name"], found["severity"], found["moment"]
        tables.append({"backend": name, "severity": None if severity is None else int(severity), "at": moment})
    return override_texts({"faults": [*_of(config), *tables]}) if tables else []


def _of(config: Path | None) -> list[Any]:
    """Return the faults of a config file; where it cannot be read, reading it for the rig says why."""
    if config is None:
        return []
    try:
        faults = tomllib.loads(config.read_text(encoding="utf-8")).get("faults", [])
    except (OSError, ValueError):
        return []
    return faults if isinstance(faults, list) else []
