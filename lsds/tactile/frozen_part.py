"""Detects a part of the image that repeats while the rest changes: dots there would seem to be at rest.

A camera's noise never repeats. Compression may make calm places repeat, and saturated or black ones do; so places that
have repeated while nothing depended on the image are left out, and so are uniform ones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.tactile.unrest import Unrest

LEAST_REPEATS = 3
"""Successive repetitions from which on a tile is frozen; chosen: compression may repeat a calm tile once or twice."""


class FrozenPart:
    """Watches the tiles of one camera."""

    def __init__(self) -> None:
        self._repeated: NDArray[np.int64] | None = None
        self._may_repeat: NDArray[np.bool_] | None = None

    def share(self, unrest: Unrest, *, learns: bool) -> float:
        """Return the share of the tiles that are frozen, after `unrest` has taken a frame.

        `learns`: nothing depends on the image, so a tile that repeats now is one that may repeat.
        """
        changes, tiles = unrest.changes, unrest.tiles
        if changes is None or tiles is None:
            self._repeated = None
            return 0.0
        if self._repeated is None or self._may_repeat is None or len(self._repeated) != len(changes):
            self._repeated = np.zeros(len(changes), np.int64)
            self._may_repeat = np.zeros(len(changes), np.bool_)
        same = changes == 0
        self._repeated = np.where(same, self._repeated + 1, 0)
        if not same.any():
            return 0.0
        if learns:
            self._may_repeat |= same
            return 0.0
        frozen = (self._repeated >= LEAST_REPEATS) & ~self._may_repeat
        frozen[frozen] = np.ptp(tiles[frozen], axis=1).any(axis=1)
        return float(frozen.mean())
