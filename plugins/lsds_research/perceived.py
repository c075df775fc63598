"""Real recordings through the perception of the cell, no detector asked, and the two setups that they are of."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lsds.session.track import UNASKED, engine_of

if TYPE_CHECKING:
    from lsds.runtime.engine import Engine

WHOLE_PAD = 50
"""A pad with at least this many dots in view is seen as a whole; one with fewer is zoomed in."""


def perceived(path: Path) -> Engine:
    """Return the engine that watches a recording. Raises ConfigError, PluginError; DataError when it is iterated."""
    return engine_of(path, None, UNASKED)
