"""Header and number."""

from __future__ import annotations

from dataclasses import dataclass, field

from builtin_interfaces.msg import Time


@dataclass
class Header:
    """Time and frame of a message."""

    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass(kw_only=True)
class Float32:
    """A number."""

    data: float = 0.0
