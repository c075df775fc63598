"""Options that campaigns of many runs have in common."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from lsds_research.cluster import HELP

Settings = Annotated[
    list[str],
    Field(description="one more config key of every run", json_schema_extra={"flag": "--with", "metavar": "KEY=VALUE"}),
]
Out = Annotated[
    str,
    Field(
        description="keep each run in this file (JSON lines); the same command goes on where it ended",
        json_schema_extra={"metavar": "FILE"},
    ),
]
Jobs = Annotated[int, Field(ge=1, le=256)]
"""Number of processes; each campaign says what they run."""
Cluster = Annotated[str, Field(description=HELP, json_schema_extra={"metavar": "ADDRESS"})]
