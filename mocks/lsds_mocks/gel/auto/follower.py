"""A grid that retraces another grid's path in small portions, so that no step waits for a whole audit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from lsds_mocks.gel.auto.path import Friction, Path
    from lsds_mocks.gel.field.gel import FieldGel

_PRESSES = 4
"""Steps in which the gel is pressed at the start of a path whose earlier legs are forgotten."""


class Follower:
    """A gel that has retraced the first `retraced` legs of a path, at a cost of `work` multiplications."""

    def __init__(self, gel: FieldGel, retraced: int = 0) -> None:
        self.gel = gel
        gel.solve_in_portions(True)
        self.retraced = retraced
        self.work = 0.0
        self._to_press = 0
        self._under_way: Iterator[None] | None = None

    def follow(self, path: Path, until: int, budget: float) -> bool:
        """Retrace up to `until` legs or until `budget` is spent; return whether all `until` legs are done.

        Each call advances by at least one solution, so that the audit always ends.
        """
        gel = self.gel
        behind = self.retraced < path.dropped or (self.retraced == 0 and gel.place != path.start)
        if behind and not self._to_press:
            gel.place = path.start
            self.retraced = path.dropped
            self._to_press, self._under_way = _PRESSES, None
        begun = gel.work
        while (self._to_press or self.retraced < until) and gel.work - begun <= budget:
            if self._under_way is None:
                self._under_way = self._next(path)
            if next(self._under_way, _DONE) is _DONE:
                self._under_way = None
        self.work += gel.work - begun
        return not self._to_press and self.retraced >= until

    def _next(self, path: Path) -> Iterator[None]:
        """Perform one step of pressing or one leg; yield after each portion."""
        gel = self.gel
        leg = path.legs[0 if self._to_press else self.retraced - path.dropped]
        gel.stand((1 - (self._to_press - 1) / _PRESSES if self._to_press else 1.0) * leg.indentation_m, leg.reach_m)
        yield
        if self._to_press:
            gel.trial(0.0, 0.0)
        else:
            if leg.friction is not None:
                gel.set_friction(_over(leg.friction, gel))
            gel.trial(leg.dx_m, leg.dy_m, leg.dtheta_rad)
        yield
        while not gel.solve_on():
            yield
        yield
        gel.commit()
        if self._to_press:
            self._to_press -= 1
        else:
            self.retraced += 1


_DONE = object()


def _over(friction: Friction, gel: FieldGel) -> NDArray[np.float64]:
    """Return friction at the cells of another grid: that of the cell around each, or the mean of the cells within."""
    own, other = friction.grid, gel.grid
    mean = friction.mean
    if not friction.values.size or float(np.ptp(friction.values)) == 0.0:
        return np.full(gel.cells.size, mean)
    full = np.full((own.rows, own.columns), mean)
    full[friction.cells // own.columns, friction.cells % own.columns] = friction.values
    if other.fine >= own.fine:
        times = other.fine // own.fine
        rows, columns = gel.cells // other.columns // times, gel.cells % other.columns // times
        return np.asarray(full[rows, columns])
    times = own.fine // other.fine
    means = full.reshape(other.rows, times, other.columns, times).mean(axis=(1, 3))
    return np.asarray(means.ravel()[gel.cells])
