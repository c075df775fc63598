"""Values of the language that Python has not: lists, poses and structs. What is calculated with them: `operations`.

Numbers, texts and booleans are Python's own. Lists and structs have value semantics: they are copied where a name, an
element or a field is bound, so that no two share anything and none contains itself.
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
