"""A grid that is led after another along the same path, a little at a time: no step has to wait for all of an audit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.auto.path import Friction, Leg, Path
    from lsds_mocks.gel.field.gel import FieldGel

_PRESSES = 4
"""Steps in which a gel is pressed where a path begins that has been forgotten up to there."""
_ENTRY = 50.0
"""Multiplications that take as long as one entry of a contact's compliance to be gathered."""
_ENTRIES = 80_000
_MOST = 250
"""Pairs of cells, and cells, that are taken in at a time."""


class Follower:
    """`gel` has been led along the first `retraced` legs of a path; `work` is what solving took, in multiplications."""

    def __init__(self, gel: FieldGel, retraced: int = 0) -> None:
        self.gel = gel
        self.retraced = retraced
        self.work = 0.0
        self._to_press = 0

    def follow(self, path: Path, until: int, budget: float) -> bool:
        """Go on to where `until` legs are done, or until `budget` is spent; tell whether it is there.

        One leg, or one step of pressing, is always gone: who stands still never arrives.
        """
        gel = self.gel
        behind = self.retraced < path.dropped or (self.retraced == 0 and gel.place != path.start)
        if behind and not self._to_press:
            gel.place = path.start
            self.retraced = path.dropped
            self._to_press = _PRESSES
        spent = 0.0
        while (self._to_press or self.retraced < until) and spent <= budget:
            spent += self._unit(path)
        return not self._to_press and self.retraced >= until

    def _unit(self, path: Path) -> float:
        """Take some cells in, or go one step of pressing, or one leg; return what it took."""
        gel = self.gel
        cells, work = gel.cells.size, gel.work
        share = 1 - (self._to_press - 1) / _PRESSES if self._to_press else 1.0
        leg = path.legs[0 if self._to_press else self.retraced - path.dropped]
        missing = gel.take_in(share * leg.indentation_m, min(_MOST, _ENTRIES // max(2 * cells, 1)))
        if missing:
            pass
        elif self._to_press:
            self._to_press -= 1
            gel.press(share * leg.indentation_m, leg.reach_m)
            gel.trial(0.0, 0.0)
            gel.commit()
        else:
            self._go(leg)
            self.retraced += 1
        self.work += gel.work - work
        return gel.work - work + _ENTRY * 9 * max(gel.cells.size**2 - cells**2, 0)

    def _go(self, leg: Leg) -> None:
        gel = self.gel
        gel.press(leg.indentation_m, leg.reach_m)
        if leg.friction is not None:
            gel.set_friction(_over(leg.friction, gel))
        gel.trial(leg.dx_m, leg.dy_m, leg.dtheta_rad)
        gel.commit()


def _over(friction: Friction, gel: FieldGel) -> NDArray[np.float64]:
    """Return friction at the cells of another grid: of the cell around it, or the mean of the cells within."""
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
