"""Images."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field

from std_msgs.msg import Header


@dataclass
class Image:
    """An image, row by row."""

    header: Header = field(default_factory=Header)
    height: int = 0
    width: int = 0
    encoding: str = ""
    is_bigendian: int = 0
    step: int = 0
    data: array[int] = field(default_factory=lambda: array("B"))
