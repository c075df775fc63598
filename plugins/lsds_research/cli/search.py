"""`lsds search`: scenarios in which the cell fails."""

from __future__ import annotations

from lsds.cli.study_command import study_command
from lsds_research.search.options import SearchOptions

search = study_command("search", SearchOptions, SearchOptions.__doc__ or "", doing="searching")
