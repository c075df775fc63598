"""The state that all nodes of the process share: topics, parameters, whether ROS runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

TOPICS: dict[str, list[Callable[[Any], None]]] = {}
"""The callbacks of each topic."""
PARAMETERS: dict[str, Any] = {}
"""Values that replace the defaults of parameters, as from a command line."""
RUNS: list[bool] = [False]
"""Whether ROS runs."""


def init() -> None:
    """Start ROS."""
    RUNS[0] = True


def try_shutdown() -> None:
    """End ROS; a second call does nothing."""
    RUNS[0] = False
    TOPICS.clear()
