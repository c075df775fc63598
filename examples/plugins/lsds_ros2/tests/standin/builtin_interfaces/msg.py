"""Times."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Time:
    """Time since 1970."""

    sec: int = 0
    nanosec: int = 0
