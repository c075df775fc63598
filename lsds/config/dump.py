"""Write a `RigConfig` as TOML that loads as an equal configuration."""

from __future__ import annotations

from lsds.config import toml
from lsds.config.model import RigConfig
from lsds.contracts.kinds import CONFIG_KINDS, KINDS


def dump_config(config: RigConfig) -> str:
    """Return the configuration as TOML. Loading it again gives an equal configuration."""
    tables = config.as_tables()
    # The default of a late kind need not be installed, but a backend named in a file has to be; so leave it out.
    for kind in CONFIG_KINDS:
        if KINDS[kind].late and config.section(kind) == type(config).model_fields[kind].default:
            del tables[kind]
    return toml.dumps(tables)
