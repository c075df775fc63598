"""The cells that touch, for contacts too large for a dense compliance: solved by descent, with answers of a rectangle.

With the friction limits held, contact with an elastic pad is a convex problem: least energy over pressures that do not
pull and frictions within their discs. It is solved by conjugate gradients on the face of that set the traction is on,
projected after each step (Polonsky and Keer 1999, Wear 231; Vollebregt 2014, J. Comput. Phys. 257), pressure and
friction at once, and preconditioned by the inverse of the layer's symbol: what is left of the spectrum lies between 1
and 6, nearly all of it at 1. A sliding cell moves along its disc's edge, as in TangCG (Zhao, Vollebregt and Oosterlee
2014), whose curvature the preconditioner takes into account. A step ends where the energy is least between two
admissible tractions, so it is admissible, costs one elastic answer, and energy never rises; should a direction lead
uphill, every cell takes its own step instead. Then the limits follow the pressures, and so on (Panagiotopoulos 1975).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.field.box import Box
from lsds_mocks.gel.field.descent import advance, aim, confine, direct, lay_out, misfit, reduce, steepest, take_in

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.operator import Operator

_ALIGNED = 4
"""Rectangles start and end at multiples of this many cells, so that their tables are rebuilt less often."""
_ROOMY = 2.0
"""A rectangle is drawn in when it is so many times as large as it need be."""
_STRICT = 0.5
_EVEN = 5.0
"""Sweeps leave little more than scattered noise when the last changes are within the tolerance, and descent something
smoother, that adds up. So that both are as good, a cell is right to this part of the tolerance, and what all of them
are off by is on the average, as a force and as a torque, less by this factor."""
_INNER = 0.9
"""The problem with limits held is solved to this part of the tolerance,"""
_FORCING = 0.4
"""or of what it was off by at first, if that is more: its limits are not the last."""
_AWAY_M = -1.0
"""Where the object stands over cells of the rectangle that are not looked after: out of reach."""
_NEGLIGIBLE = 1e-6
"""Change of traction, as part of the greatest pressure, that is rounding."""
_LONGER = 1.1
"""Steps are tried this much longer than the last was best: one that ends short is cut to the best length, one that is
too short is not made longer."""
_LENGTH, _LENGTHS, _PACES = 0.5, (0.1, 2.0), (0.3, 2.0)
_LOOPS = 6
_PATIENT = 0.6
"""Where after so many loops the limits have not settled, as under high friction, where shear changes the pressure that
carries it, each goes a part of the way, this to begin with."""


class SpectralPatch:
    """Numbered cells of a grid, like `lsds_mocks.gel.field.dense.Patch` in all that it does, with the same operator."""

    def __init__(self, operator: Operator) -> None:
        self.operator = operator
        self.cells = np.zeros(0, np.int32)
        table = operator.cells
        self._kz = float(table[2, 2, 0, 0])
        self._kt = float(max(table[0, 0, 0, 0], table[1, 1, 0, 0]) + abs(table[0, 1, 0, 0]))
        self._box: Box | None = None

    @property
    def size(self) -> int:
        """Number of cells."""
        return len(self.cells)

    def add(self, cells: NDArray[np.int32]) -> None:
        """Take cells in that are not in yet."""
        self.cells = np.concatenate([self.cells, cells]).astype(np.int32)
        self._enclose()

    def keep(self, which: NDArray[np.bool_]) -> None:
        """Let all other cells go."""
        self.cells = self.cells[which]
        self._enclose()

    def _enclose(self) -> None:
        """Draw the rectangle around the cells, if it does not fit."""
        if not self.size:
            self._box = None
            return
        grid = self.operator.grid
        rows, columns = self.cells // grid.columns, self.cells % grid.columns
        row, height = _span(rows, grid.rows)
        column, width = _span(columns, grid.columns)
        box = self._box
        if box is None or not box.covers(rows, columns) or box.rows * box.columns > _ROOMY * height * width:
            self._box = box = Box(self.operator, row, column, height, width)
            self._y, self._r, self._d, self._step, self._answer, self._gradient, self._before = np.zeros(
                (7, 3, height * width), np.float32
            )
            self._face = np.zeros((4, height * width), np.float32)
            self._pace = np.zeros((2, height * width), np.float32)
            self._work = np.zeros(height * width, np.float32)
            self._arm = _arm(height, width, grid.dy_m / grid.dx_m)
        self._at = (rows - box.row) * box.columns + columns - box.column
        self._friction = np.zeros(box.rows * box.columns, np.float32)
        self._limit = np.zeros_like(self._friction)
        self._target = np.zeros((3, box.rows * box.columns), np.float32)
        self._target[2] = _AWAY_M

    def _answer_to(self, box: Box, traction: NDArray[np.float32], out: NDArray[np.float32]) -> None:
        shape = (3, box.rows, box.columns)
        box.respond(traction.reshape(shape), out.reshape(shape))

    def respond(self, traction: NDArray[np.float32], w: NDArray[np.float32], known: int = 0) -> None:
        """Write the displacement of the cells from `known` on under `traction`."""
        if self._box is None:
            return
        self._step[:] = 0.0
        self._step[:, self._at] = traction
        self._answer_to(self._box, self._step, self._answer)
        w[:, known:] = self._answer[:, self._at[known:]]

    def relax(
        self,
        traction: NDArray[np.float32],
        w: NDArray[np.float32],
        target: NDArray[np.float32],
        friction: NDArray[np.float32],
        slid: NDArray[np.bool_],
        tolerance: float,
        sweeps: int,
    ) -> int:
        """Solve for `traction` (3, n) and `w` (3, n) from what they are, which have to belong together.

        It is done when no cell, set right by itself, would change its traction by more than half of `tolerance` times
        the greatest pressure, nor all of them by more than a tenth on the average. Pressures are then not negative,
        friction is within its limit; `slid` is set where a cell slides or does not touch. Return the iterations, at
        least 1, or -1 where `sweeps` were not enough.
        """
        box = self._box
        if box is None:
            return 1
        # Inactive cells carry no traction, so their displacement is arbitrary.
        lay_out(self._at, traction, w, target, friction, self._y, self._r, self._target, self._friction)
        done = self._descend(box, _STRICT * tolerance, sweeps)
        take_in(self._at, self._y, self._r, self._limit, self._kt, target, traction, w, slid)
        return done

    def work(self, iterations: int) -> float:
        """Return the multiplications that so many iterations take."""
        return iterations * self._box.work if self._box is not None else 0.0

    def _descend(self, box: Box, tolerance: float, sweeps: int) -> int:
        """Solve for `_y` and `_r`."""
        # Only traction and displacement are carried from one solution to the next: what is repeated comes out alike.
        self._length = _LENGTH
        done = loops = 0
        ready = tolerance
        while True:
            patient = loops >= _LOOPS
            if loops == _LOOPS:
                self._pace[0], self._pace[1] = _PATIENT, 0.0
            off = self._follow(box, patient)
            if patient and (off <= ready or done >= sweeps):
                # The limits go the rest of the way at once; where that is too far, they have to come nearer first.
                off, patient, ready = self._follow(box, False), False, _FORCING * ready
            if off <= tolerance and not patient:
                return max(done, 1)
            if done >= sweeps:
                return -1
            done += self._hold(box, ready, sweeps - done)
            loops += 1

    def _follow(self, box: Box, patient: bool) -> float:
        """Let the limits follow the pressures; return how far off the traction is, as part of the greatest pressure."""
        y, r = self._y, self._r
        greatest, change = confine(y, r, self._friction, self._kt, patient, self._pace, self._limit, self._step)
        if change > _NEGLIGIBLE * greatest:
            self._answer_to(box, self._step, self._answer)
            r += self._answer
        self._greatest = greatest
        off = misfit(y, r, self._friction, True, self._kt, self._kz, self._arm, _EVEN, self._work)
        return off / greatest if greatest > 0.0 else math.inf if off > 0.0 else 0.0

    def _hold(self, box: Box, tolerance: float, most: int) -> int:
        """Descend with the limits as they are; return the iterations done, at least 1."""
        y, r, d, limit, kt, kz = self._y, self._r, self._d, self._limit, self._kt, self._kz
        goal = _FORCING * misfit(y, r, limit, False, kt, kz, self._arm, _EVEN, self._work)
        product, done = 0.0, 0
        while True:
            product = self._conjugate(box, product)
            slope = aim(y, r, d, self._length, limit, self._face, self._step)
            uphill = slope >= 0.0
            if uphill:
                steepest(self._gradient, self._face, kt, kz, d)
                slope, product = aim(y, r, d, 1.0, limit, self._face, self._step), 0.0
            self._answer_to(box, self._step, self._answer)
            best, self._greatest = advance(y, r, self._step, self._answer, slope)
            if not uphill:
                pace = min(max(_LONGER * best, _PACES[0]), _PACES[1])
                self._length = min(max(pace * self._length, _LENGTHS[0]), _LENGTHS[1])
            done += 1
            off = misfit(y, r, limit, False, kt, kz, self._arm, _EVEN, self._work)
            if done == most or off <= max(goal, _INNER * tolerance * self._greatest):
                return done

    def _conjugate(self, box: Box, product: float) -> float:
        """Find the next direction; `product` is what it returned for the last, or 0 to start afresh."""
        z, shape = self._answer, (3, box.rows, box.columns)
        self._gradient, self._before = self._before, self._gradient
        reduce(
            self._y, self._r, self._limit, self._kt, self._kz, self._greatest, self._face, self._gradient, self._step
        )
        box.precondition(self._step.reshape(shape), z.reshape(shape))
        return float(direct(z, self._gradient, self._before, product, self._d, self._face))


def _span(places: NDArray[np.int32], cells: int) -> tuple[int, int]:
    """Return where an aligned stretch of all places begins, and how long it is."""
    first = int(places.min()) // _ALIGNED * _ALIGNED
    last = min(cells, -(-(int(places.max()) + 1) // _ALIGNED) * _ALIGNED)
    return first, last - first


def _arm(rows: int, columns: int, ratio: float) -> NDArray[np.float32]:
    """Return where the cells of a rectangle are (2, cells) from its middle; their mean square is 1."""
    y, x = np.meshgrid(
        ratio * (np.arange(rows) - (rows - 1) / 2), np.arange(columns) - (columns - 1) / 2, indexing="ij"
    )
    arm = np.stack([x.ravel(), y.ravel()])
    size = np.sqrt(np.mean(np.sum(arm * arm, axis=0)))
    return np.asarray(arm / max(size, 1.0), np.float32)
