"""Options that campaigns of many runs have in common."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from lsds_research.cluster import HELP

Settings = Annotated[
    list[str],
    Field(description="config key that every run sets", json_schema_extra={"flag": "--with", "metavar": "KEY=VALUE"}),
]
Out = Annotated[
    str,
    Field(
        description="store each run in this file (JSON lines); the same command continues from it",
        json_schema_extra={"metavar": "FILE"},
    ),
]
Jobs = Annotated[int, Field(ge=1, le=256)]
"""Number of processes; each campaign describes what one process runs."""
Cluster = Annotated[str, Field(description=HELP, json_schema_extra={"metavar": "ADDRESS"})]
Random = Annotated[
    bool,
    Field(
        description="draw shape, size, mass, friction, stiffness, relief and gel instead of objects of the catalogue; "
        "what a firm grip does not hold either is no failure"
    ),
]
