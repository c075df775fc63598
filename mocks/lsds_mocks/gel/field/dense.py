"""Contact solver on the dense compliance of the cells that touch or nearly touch, a set that changes with the contact.

`compliance[i, a, b, j]` is the displacement b of cell j per traction a (0 x, 1 y, 2 pressure) in cell i, gathered from
the layer's table and the pad's correction. It is symmetric under (i, a) <-> (j, b). A cell's three columns are adjacent
in memory, in the order in which the sweep reads them.

A nonlinear Gauss-Seidel iteration solves friction contact (Jourdan, Alart and Jean 1998). It sets pressure and friction
of one cell at a time so that this cell satisfies its conditions while all others stay fixed:

    p <- max(0, p - (w_z - b_z) / K_zz),    q <- disc of radius mu p nearest to q - (w_t - b_t) / K_tt,

and updates the displacement w of all cells at once. `b_z` is the depth of the object over a cell, `b_t` the position to
which it has carried a sticking cell. The sweep skips cells that are right to a fraction of the tolerance, so a scene
with little change costs little.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from lsds_mocks.gel.field.correction import hats_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.operator import Operator


_TILE_ROWS = 16
"""Rows and columns of a tile; 16 values of four bytes fill a cache line of 64 bytes."""


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def gather(
    compliance: NDArray[np.float32],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    known: int,
    count: int,
    table: NDArray[np.float32],
) -> None:
    """Fill the rows `known` to `count` from the table, up to the diagonal."""
    ny, nx = table.shape[2], table.shape[3]
    flat = table.reshape(3, 3, ny * nx)
    at = np.zeros(count, np.int64)
    for i in range(known, count):
        for j in range(i + 1):
            dr, dc = rows[j] - rows[i], columns[j] - columns[i]
            at[j] = (dr + ny if dr < 0 else dr) * nx + (dc + nx if dc < 0 else dc)
        for a in range(3):
            for b in range(3):
                t, out = flat[b, a], compliance[i, a, b]
                for j in range(i + 1):
                    out[j] = t[at[j]]


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def correct(
    compliance: NDArray[np.float32],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    known: int,
    count: int,
    correction: NDArray[np.float32],
    fine: int,
    hat_rows: int,
    hat_columns: int,
) -> None:
    """Add the pad's correction, (3, nodes, 3, nodes) in metres per pascal in a cell, to the rows `known` to `count`, up
    to the diagonal."""
    # Unsigned indices save the check for negative values; columns are read consecutively.
    place, share = np.zeros((4, count), np.uint32), np.zeros((4, count), np.float32)
    node, weight = np.zeros(4, np.int64), np.zeros(4)
    number, needed, many = np.full(correction.shape[1], -1), np.zeros(correction.shape[1], np.uint32), 0
    for i in range(count):
        hats_of((rows[i] + 0.5) / fine, (columns[i] + 0.5) / fine, hat_rows, hat_columns, node, weight)
        for h in range(4):
            if number[node[h]] < 0:
                number[node[h]], needed[many] = many, node[h]
                many += 1
            place[h, i], share[h, i] = number[node[h]], weight[h]
    p0, p1, p2, p3 = place
    w0, w1, w2, w3 = share
    at_node = np.zeros((3, many), np.float32)
    for i in range(known, count):
        for a in range(3):
            s0, s1 = correction[a, needed[p0[i]]], correction[a, needed[p1[i]]]
            s2, s3 = correction[a, needed[p2[i]]], correction[a, needed[p3[i]]]
            for b in range(3):
                s, out = at_node[b], compliance[i, a, b]
                for k in range(many):
                    n = needed[k]
                    s[k] = w0[i] * s0[b, n] + w1[i] * s1[b, n] + w2[i] * s2[b, n] + w3[i] * s3[b, n]
                for j in range(i + 1):
                    out[j] += w0[j] * s[p0[j]] + w1[j] * s[p1[j]] + w2[j] * s[p2[j]] + w3[j] * s[p3[j]]


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def mirror(compliance: NDArray[np.float32], known: int, count: int) -> None:
    """Fill the columns `known` to `count` beyond the diagonal from the mirrored rows.

    It works tile by tile, so that each cache line is fetched once.
    """
    for i0 in range(known, count, _TILE_ROWS):
        i1 = min(i0 + _TILE_ROWS, count)
        for j0 in range(0, i1, _TILE_ROWS):
            j1 = min(j0 + _TILE_ROWS, i1)
            for a in range(3):
                for b in range(3):
                    for j in range(j0, j1):
                        out = compliance[j, b, a]
                        for i in range(max(i0, j + 1), i1):
                            out[i] = compliance[i, a, b, j]


_SKIP = 0.03
"""Smallest change that is applied, as part of the tolerance."""
_FULL = 30
"""Sweeps with full changes. Cells that still alternate then, as under high friction at a free wall where shear raises
the pressure that carries it, are damped."""
_DAMPED = 0.4
"""Part of a change that is applied to a damped cell."""


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def own(compliance: NDArray[np.float32], diagonal: NDArray[np.float32], known: int, count: int) -> None:
    """Write each new cell's own compliance (n, 4): K_zz, K_tt, and pressure to motion along x and y."""
    for i in range(known, count):
        diagonal[i, 0] = compliance[i, 2, 2, i]
        cross = abs(compliance[i, 0, 1, i])
        diagonal[i, 1] = max(compliance[i, 0, 0, i], compliance[i, 1, 1, i]) + cross
        diagonal[i, 2] = compliance[i, 2, 0, i]
        diagonal[i, 3] = compliance[i, 2, 1, i]


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def respond(
    compliance: NDArray[np.float32], traction: NDArray[np.float32], w: NDArray[np.float32], known: int, count: int
) -> None:
    """Compute the displacement (3, n) of cells `known` to `count` afresh."""
    w[:, known:count] = 0.0
    for i in range(count):
        tx, ty, p = traction[0, i], traction[1, i], traction[2, i]
        if tx == 0.0 and ty == 0.0 and p == 0.0:
            continue
        for b in range(3):
            kx, ky, kz, out = compliance[i, 0, b], compliance[i, 1, b], compliance[i, 2, b], w[b]
            for j in range(known, count):
                out[j] += kx[j] * tx + ky[j] * ty + kz[j] * p


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def relax(
    compliance: NDArray[np.float32],
    diagonal: NDArray[np.float32],
    traction: NDArray[np.float32],
    w: NDArray[np.float32],
    target: NDArray[np.float32],
    friction: NDArray[np.float32],
    slid: NDArray[np.bool_],
    count: int,
    tolerance: float,
    sweeps: int,
) -> int:
    """Sweep until no traction changes by more than `tolerance` times the greatest pressure.

    Return the number of sweeps, or -1 if `sweeps` were not enough.
    """
    for done in range(1, sweeps + 1):
        greatest = np.float32(0.0)
        for i in range(count):
            greatest = max(greatest, traction[2, i])
        small = np.float32(tolerance) * greatest
        skip = np.float32(_SKIP) * small
        change = np.float32(0.0)
        share = np.float32(1.0) if done <= _FULL else np.float32(_DAMPED)
        for i in range(count):
            p = traction[2, i]
            new_p = max(np.float32(0.0), p - (w[2, i] - target[2, i]) / diagonal[i, 0])
            if new_p == 0.0 and p == 0.0:
                slid[i] = True
                continue
            dp = new_p - p
            kt = diagonal[i, 1]
            x = traction[0, i] - (w[0, i] + diagonal[i, 2] * dp - target[0, i]) / kt
            y = traction[1, i] - (w[1, i] + diagonal[i, 3] * dp - target[1, i]) / kt
            size, limit = np.sqrt(x * x + y * y), friction[i] * new_p
            slid[i] = size > limit
            if size > limit:
                x *= limit / size
                y *= limit / size
            if done > _FULL:
                new_p = p + share * dp
                dp = new_p - p
                x = traction[0, i] + share * (x - traction[0, i])
                y = traction[1, i] + share * (y - traction[1, i])
            dx, dy = x - traction[0, i], y - traction[1, i]
            step = max(abs(dp), max(abs(dx), abs(dy)))
            # Never skip a change that ends the contact, or that returns the traction to a limit that has fallen or
            # that the initial guess made negative.
            held = friction[i] * max(p, np.float32(0.0)) * np.float32(1.00001)
            if step <= skip and new_p > 0.0 and traction[0, i] ** 2 + traction[1, i] ** 2 <= held * held:
                continue
            change = max(change, step)
            traction[0, i], traction[1, i], traction[2, i] = x, y, new_p
            for b in range(3):
                kx, ky, kz, out = compliance[i, 0, b], compliance[i, 1, b], compliance[i, 2, b], w[b]
                for j in range(count):
                    out[j] += kx[j] * dx + ky[j] * dy + kz[j] * dp
        if change <= small:
            return done
    return -1


_GROWTH_ROWS = 64
"""Number of cells of which the size of the arrays is a multiple; chosen."""


class Patch:
    """Numbered cells of a grid, their tractions (3, n) in pascal (on the gel: x, y, pressure) and their mean
    displacement (3, n) in metres (x, y, into the gel)."""

    def __init__(self, operator: Operator) -> None:
        self.operator = operator
        self.cells = np.zeros(0, np.int32)
        self._rows = np.zeros(0, np.int32)
        self._columns = np.zeros(0, np.int32)
        self._compliance = np.zeros((_GROWTH_ROWS, 3, 3, _GROWTH_ROWS), np.float32)
        self._diagonal = np.zeros((_GROWTH_ROWS, 4), np.float32)

    @property
    def size(self) -> int:
        """Number of cells."""
        return len(self.cells)

    def reserve(self, count: int) -> None:
        """Enlarge the arrays to hold at least `count` cells; keep their content."""
        if count <= len(self._diagonal):
            return
        n, room = self.size, -(-count * 5 // 4 // _GROWTH_ROWS) * _GROWTH_ROWS
        compliance = np.zeros((room, 3, 3, room), np.float32)
        diagonal = np.zeros((room, 4), np.float32)
        if n:
            compliance[:n, :, :, :n] = self._compliance[:n, :, :, :n]
            diagonal[:n] = self._diagonal[:n]
        self._compliance, self._diagonal = compliance, diagonal

    def add(self, cells: NDArray[np.int32]) -> None:
        """Add cells that are not included yet."""
        known = self.size
        count = known + len(cells)
        self.reserve(count)
        columns = self.operator.grid.columns
        self.cells = np.concatenate([self.cells, cells]).astype(np.int32)
        self._rows, self._columns = self.cells // columns, self.cells % columns
        place = (self._compliance, self._rows, self._columns, known, count)
        gather(*place, self.operator.cells)
        if self.operator.correction.size:
            grid = self.operator.grid
            correct(*place, self.operator.correction, grid.fine, grid.hats.rows, grid.hats.columns)
        mirror(self._compliance, known, count)
        own(self._compliance, self._diagonal, known, count)

    def keep(self, which: NDArray[np.bool_]) -> None:
        """Remove all other cells."""
        kept = np.flatnonzero(which)
        self._compliance[: len(kept), :, :, : len(kept)] = self._compliance[kept][..., kept]
        self._diagonal[: len(kept)] = self._diagonal[kept]
        self.cells = self.cells[kept]
        self._rows, self._columns = self._rows[kept], self._columns[kept]

    def respond(self, traction: NDArray[np.float32], w: NDArray[np.float32], known: int = 0) -> None:
        """Write the displacement of the cells from `known` on under `traction`."""
        respond(self._compliance, traction, w, known, self.size)

    @property
    def compliance(self) -> NDArray[np.float32]:
        """A view (n, 3, 3, n) of the compliance, metres per pascal: cell and component that load, component and cell
        that move."""
        return self._compliance[: self.size, :, :, : self.size]

    def depths(self) -> NDArray[np.float32]:
        """Return (n, 3, n): depth of all cells per traction (x, y, pressure) in each cell, metres per pascal."""
        return np.ascontiguousarray(self._compliance[: self.size, :, 2, : self.size])

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
        """Solve for `traction` and `w`, see `lsds_mocks.gel.field.dense`."""
        return int(
            relax(self._compliance, self._diagonal, traction, w, target, friction, slid, self.size, tolerance, sweeps)
        )

    def work(self, sweeps: int) -> float:
        """Return the maximum number of multiplications of `sweeps` sweeps."""
        return 9.0 * sweeps * self.size**2
