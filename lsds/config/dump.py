"""From a `RigConfig` back to TOML that loads as an equal one."""

from __future__ import annotations

from lsds.config import toml
from lsds.config.model import RigConfig
from lsds.contracts.kinds import CONFIG_KINDS, KINDS


def dump_config(config: RigConfig) -> str:
    """Return the configuration as TOML. Loading it again gives an equal configuration."""
    tables = config.as_tables()
    # What is built late need not be installed to be the default: said again, it would have to be.
    for kind in CONFIG_KINDS:
        if KINDS[kind].late and config.section(kind) == type(config).model_fields[kind].default:
            del tables[kind]
    return toml.dumps(tables)
