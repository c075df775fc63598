"""The job of a campaign's runs: a lift, or at least one that ends by itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds.errors import ConfigError, ConfigIssue

if TYPE_CHECKING:
    from lsds.config import RigConfig

LIFT = "lift"
"""Job whose end is a verdict on the grip."""
ENDLESS = ("hold", "watch")
"""Jobs that end by themselves only after their `duration_s`."""


def require_lift(config: RigConfig) -> None:
    """Raise ConfigError for another job than a lift: it may release the object on purpose, or never end."""
    name = config.section("job").backend.rpartition(":")[2]
    if name != LIFT:
        problem = f"'{name}' is no lift, and this study counts lifts that lose their object"
        raise ConfigError("the study's job", [ConfigIssue("job.backend", problem, f'write job.backend = "{LIFT}"')])


def require_end(config: RigConfig) -> None:
    """Raise ConfigError for a job that never ends by itself."""
    job = config.section("job")
    name = job.backend.rpartition(":")[2]
    if name in ENDLESS and not job.options().get("duration_s"):
        problem = f"'{name}' never ends by itself, and this study waits for the end of each run"
        remedy = f'write job.backend = "{LIFT}", or job.{name}.duration_s = 1'
        raise ConfigError("the study's job", [ConfigIssue("job.backend", problem, remedy)])
