"""Keys of a space that settings hold fixed, directly or by the name of an object."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from lsds_mocks.objects.catalogue import CATALOGUE

from lsds_research.search.objects import CELL, SHARE
from lsds_research.search.space import Axis, values_of

_OBJECT = f"{CELL}object"


def held_fixed(space: Sequence[Axis], settings: Iterable[str]) -> tuple[tuple[Axis, ...], list[str]]:
    """Return the space with the axes of keys that settings hold fixed at their values, and those keys.

    Settings count above drawn values: an axis of such a key would be drawn without an effect. In the space of random
    objects the name of an object fixes its properties, too; in another space it leaves them to the axes.
    """
    values = values_of(settings)
    if any(axis.key == SHARE for axis in space):
        values = _of_the_object(values) | values
    fixed = [axis.key for axis in space if axis.key in values]
    held = (
        Axis(axis.key, choices=(values[axis.key],), usual=values[axis.key]) if axis.key in values else axis
        for axis in space
    )
    return tuple(held), fixed


def _of_the_object(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the catalogue's values of the object that is named, none if there is no such name."""
    name = values.get(_OBJECT)
    spec = CATALOGUE.get(name) if isinstance(name, str) else None  # type: ignore[call-overload]
    if spec is None:
        return {}
    found = {f"{CELL}{key}": value for key, value in dataclasses.asdict(spec).items()}
    return found | {SHARE: spec.kinetic_friction / spec.static_friction}
