"""Values of the language without a Python equivalent: lists, poses and structs; `operations` calculates with them.

Numbers, texts and booleans are Python's. Lists and structs have value semantics: binding them to a name, an element or
a field copies them, so that no two share data and none contains itself.
"""

from __future__ import annotations

from typing import Any


class UrList(list[Any]):
    """A list, or a matrix as a list of lists."""

    __slots__ = ()


class Pose(UrList):
    """p[x, y, z, rx, ry, rz]: metres, and a rotation vector in radians."""

    __slots__ = ()


class Struct(dict[str, Any]):
    """Named fields, read and written as attributes in a script."""

    __slots__ = ()
