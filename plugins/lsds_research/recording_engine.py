"""Perception of real recordings without a trained detector, and the two setups of the recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lsds.session.track import UNASKED, engine_of

if TYPE_CHECKING:
    from lsds.runtime.engine import Engine

WHOLE_PAD_VISIBLE = 50
"""Minimum number of visible markers of a whole pad; a pad with fewer is zoomed in."""


def recording_engine(path: Path) -> Engine:
    """Return an engine that reads a recording. Raises ConfigError, PluginError, DataError."""
    return engine_of(path, None, UNASKED)
