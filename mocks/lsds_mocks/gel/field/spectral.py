"""Contact solver for contacts too large for a dense compliance: descent with the elastic response of a rectangle.

With fixed friction limits, contact with an elastic pad is a convex problem: least energy over non-negative pressures
and frictions within their discs. Conjugate gradients solve it for pressure and friction together, on the face of the
admissible set that holds the traction, with a projection after each step (Polonsky and Keer 1999, Wear 231; Vollebregt
2014, J. Comput. Phys. 257). The preconditioner is the inverse of the layer's symbol; the preconditioned spectrum lies
between 1 and 6, nearly all of it at 1. A sliding cell moves along the edge of its disc, as in TangCG (Zhao, Vollebregt
and Oosterlee 2014); the preconditioner accounts for the edge's curvature. A step ends at the least energy between two
admissible tractions. It is therefore admissible, costs one elastic response, and never raises the energy. If a
direction leads uphill, every cell takes its own step instead. Then the limits are updated from the pressures, and the
problem is solved again (Panagiotopoulos 1975).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.field.box import MOST_WHOLE_CELLS, Box
from lsds_mocks.gel.field.descent import advance, aim, confine, direct, lay_out, misfit, reduce, steepest, take_in

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.operator import Operator

_ALIGNED = 4
"""Rectangles start and end at multiples of this many cells, so that their tables are rebuilt less often."""
_ROOMY = 2.0
"""A rectangle shrinks when it is this many times as large as necessary."""
_STRICT = 0.5
"""Greatest residual change of a cell, as part of the tolerance. It is stricter than for sweeps, which leave scattered
noise, because descent leaves smooth errors that add up."""
_EVEN_FACTOR = 5.0
"""Factor by which the average residual, as force and as torque, must be smaller than that of a single cell."""
_INNER = 0.9
"""Residual to which the problem with fixed limits is solved, as part of the tolerance."""
_FORCING = 0.4
"""The same as part of the initial residual, which applies if it is greater, because the limits are not final yet."""
_AWAY_M = -1.0
"""Depth of the object over the inactive cells of the rectangle: out of reach."""
_NEGLIGIBLE = 1e-6
"""Change of traction, as part of the greatest pressure, that counts as rounding."""
_LONGER = 1.1
"""Length of a trial step over the best length of the last one; a step that is too long is cut, but a short one is not
extended."""
_FIRST_LENGTH = 0.5
"""Length of the first trial step; chosen."""
_LENGTH_RANGE = (0.1, 2.0)
"""Smallest and largest length of a trial step; chosen."""
_PACE_RANGE = (0.3, 2.0)
"""Smallest and largest factor from one trial step to the next; chosen."""
_LOOPS = 6
"""Loops after which limits that have not settled make only a part of their change, as under high friction where shear
changes the pressure that carries it."""
_PATIENT = 0.6
"""Initial part of its change that such a limit makes."""


class SpectralPatch:
    """Numbered cells of a grid, with the interface and the operator of `lsds_mocks.gel.field.dense.Patch`."""

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
        """Add cells that are not included yet."""
        self.cells = np.concatenate([self.cells, cells]).astype(np.int32)
        self._enclose()

    def keep(self, which: NDArray[np.bool_]) -> None:
        """Remove all other cells."""
        self.cells = self.cells[which]
        self._enclose()

    def _enclose(self) -> None:
        """Fit the rectangle to the cells if it is too small or much too large."""
        if not self.size:
            self._box = None
            return
        grid = self.operator.grid
        rows, columns = self.cells // grid.columns, self.cells % grid.columns
        row, height = _span(rows, grid.rows)
        column, width = _span(columns, grid.columns)
        if grid.size <= MOST_WHOLE_CELLS:
            row, column, height, width = 0, 0, grid.rows, grid.columns
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
        """Write the displacement of the cells from number `known` on under `traction`."""
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
        """Solve for `traction` (3, n) and `w` (3, n), starting from their consistent present values.

        The solution is accepted when correcting any single cell would change its traction by at most half of
        `tolerance` times the greatest pressure, and all cells by at most a tenth of it on average. Pressures are then
        not negative, and friction is within its limit; `slid` marks cells that slide or do not touch. Return the
        iterations, 0 if the present values are the solution, or -1 if `sweeps` were not enough.
        """
        box = self._box
        if box is None:
            return 0
        # Inactive cells carry no traction, so their displacement is arbitrary.
        lay_out(self._at, traction, w, target, friction, self._y, self._r, self._target, self._friction)
        done = self._descend(box, _STRICT * tolerance, sweeps)
        take_in(self._at, self._y, self._r, self._limit, self._kt, target, traction, w, slid)
        return done

    def work(self, iterations: int) -> float:
        """Return the multiplications of `iterations` iterations."""
        return iterations * self._box.work if self._box is not None else 0.0

    def _descend(self, box: Box, tolerance: float, sweeps: int) -> int:
        """Solve for `_y` and `_r`."""
        # Solutions share nothing but traction and displacement, so repeating one gives the same result.
        self._length = _FIRST_LENGTH
        done = loops = 0
        ready = tolerance
        while True:
            patient = loops >= _LOOPS
            if loops == _LOOPS:
                self._pace[0], self._pace[1] = _PATIENT, 0.0
            off = self._follow(box, patient)
            if patient and (off <= ready or done >= sweeps):
                # Limits close to the solution make their full change; others have to come nearer first.
                off, patient, ready = self._follow(box, False), False, _FORCING * ready
            if off <= tolerance and not patient:
                return done
            if done >= sweeps:
                return -1
            done += self._hold(box, ready, sweeps - done)
            loops += 1

    def _follow(self, box: Box, patient: bool) -> float:
        """Update the limits from the pressures; return the traction's residual, as part of the greatest pressure."""
        y, r = self._y, self._r
        greatest, change = confine(y, r, self._friction, self._kt, patient, self._pace, self._limit, self._step)
        if change > _NEGLIGIBLE * greatest:
            self._answer_to(box, self._step, self._answer)
            r += self._answer
        self._greatest = greatest
        off = misfit(y, r, self._friction, True, self._kt, self._kz, self._arm, _EVEN_FACTOR, self._work)
        return off / greatest if greatest > 0.0 else math.inf if off > 0.0 else 0.0

    def _hold(self, box: Box, tolerance: float, most: int) -> int:
        """Descend with fixed limits; return the number of iterations, at least 1."""
        y, r, d, limit, kt, kz = self._y, self._r, self._d, self._limit, self._kt, self._kz
        goal = _FORCING * misfit(y, r, limit, False, kt, kz, self._arm, _EVEN_FACTOR, self._work)
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
                pace = min(max(_LONGER * best, _PACE_RANGE[0]), _PACE_RANGE[1])
                self._length = min(max(pace * self._length, _LENGTH_RANGE[0]), _LENGTH_RANGE[1])
            done += 1
            off = misfit(y, r, limit, False, kt, kz, self._arm, _EVEN_FACTOR, self._work)
            if done == most or off <= max(goal, _INNER * tolerance * self._greatest):
                return done

    def _conjugate(self, box: Box, product: float) -> float:
        """Find the next direction; `product` is the value returned for the last direction, or 0 to restart."""
        z, shape = self._answer, (3, box.rows, box.columns)
        self._gradient, self._before = self._before, self._gradient
        reduce(
            self._y, self._r, self._limit, self._kt, self._kz, self._greatest, self._face, self._gradient, self._step
        )
        box.precondition(self._step.reshape(shape), z.reshape(shape))
        return float(direct(z, self._gradient, self._before, product, self._d, self._face))


def _span(places: NDArray[np.int32], cells: int) -> tuple[int, int]:
    """Return start and length of the aligned range that holds all places."""
    first = int(places.min()) // _ALIGNED * _ALIGNED
    last = min(cells, -(-(int(places.max()) + 1) // _ALIGNED) * _ALIGNED)
    return first, last - first


def _arm(rows: int, columns: int, ratio: float) -> NDArray[np.float32]:
    """Return the positions (2, cells) of a rectangle's cells relative to its middle, scaled to a mean square of 1."""
    y, x = np.meshgrid(
        ratio * (np.arange(rows) - (rows - 1) / 2), np.arange(columns) - (columns - 1) / 2, indexing="ij"
    )
    arm = np.stack([x.ravel(), y.ravel()])
    size = np.sqrt(np.mean(np.sum(arm * arm, axis=0)))
    return np.asarray(arm / max(size, 1.0), np.float32)
