"""The smallest scenario that still fails: keys return to their usual values, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds_research.search.space import Axis, Scenario


def shrunk(scenario: Scenario, space: Sequence[Axis], fails: Callable[[Scenario], bool], most: int = 64) -> Scenario:
    """Return a scenario with fewer keys that also fails; `fails` runs a scenario, at most `most` times.

    The first step removes all keys with usual values at once, if the scenario still fails: a key that is set may behave
    differently from an unset one. Further steps remove half of the keys, then a quarter, down to one (Zeller's delta
    debugging), because most keys have no effect.
    """
    usual = {axis.key: axis.usual for axis in space}
    left, runs = dict(scenario), 0
    unusual = {key: value for key, value in left.items() if value != usual.get(key)}
    if len(unusual) < len(left) and most > 0:
        runs += 1
        left = unusual if fails(unusual) else left
    size = max(1, len(left) // 2)
    while left:
        went = False
        for chunk in _chunks(list(left), size):
            if runs >= most:
                return left
            fewer = {key: value for key, value in left.items() if key not in chunk}
            runs += 1
            if fails(fewer):
                left, went = fewer, True
        if size == 1 and not went:
            return left
        size = max(1, min(size // 2, len(left)))
    return left


def _chunks(keys: Sequence[str], size: int) -> list[set[str]]:
    return [set(keys[at : at + size]) for at in range(0, len(keys), size)]
