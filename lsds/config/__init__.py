"""The configuration of a rig: TOML is read into one frozen model, and all problems are reported together."""

from lsds.config.dump import dump_config
from lsds.config.loader import check_config, load_config
from lsds.config.model import BackendSection, ControllerSection, PluginOptions, RigConfig, ScheduleOptions
from lsds.config.schema import json_schema

__all__ = [
    "BackendSection",
    "ControllerSection",
    "PluginOptions",
    "RigConfig",
    "ScheduleOptions",
    "check_config",
    "dump_config",
    "json_schema",
    "load_config",
]
