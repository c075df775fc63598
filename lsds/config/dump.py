"""From a `RigConfig` back to TOML that loads as an equal one."""

from __future__ import annotations

from lsds.config import toml
from lsds.config.model import RigConfig


def dump_config(config: RigConfig) -> str:
    """Return the configuration as TOML. Loading it again gives an equal configuration."""
    return toml.dumps(config.as_tables())
