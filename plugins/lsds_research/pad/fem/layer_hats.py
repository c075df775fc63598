"""Compliance between the same hats on the periodic layer, by the same elements: one hat interval and its waves.

In a layer that repeats after N hat intervals along an axis, motions are sums of N waves that differ from one interval
to the next by a phase only (Bloch); each is a problem on one interval. The layer is computed with the same
elements, not in exact form (see `lsds_mocks.gel.field.operator`): the error of the elements at a load is equal in the
pad and cancels. The difference is positive semi-definite, and smooth enough for hats.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lsds_research.pad.fem import mesh as meshes
from lsds_research.pad.fem.axis import Products, load, nodes_of, products
from lsds_research.pad.fem.solid import AXES, Line, stiffness

if TYPE_CHECKING:
    from lsds_mocks.gel.field.grid import HatGrid
    from numpy.typing import NDArray

    from lsds_research.pad.fem.mesh import Mesh

_HALVES = 2
"""A hat rises over one interval and falls over the next; at a wall it has one of the two."""


def layer_matrix(hats: HatGrid, poisson: float, mesh: Mesh) -> NDArray[np.float64]:
    """Return (3 nodes, 3 nodes): work of each of the pad's hats on what each moves, in units of Young's modulus and
    thickness; hats at the pad's walls are cut off there."""
    table = _table(hats, poisson, mesh)
    row, column = np.divmod(np.arange(hats.nodes), hats.columns + 1)
    down = (row[:, None] - row[None, :]) % hats.period_y
    across = (column[:, None] - column[None, :]) % hats.period_x
    halves = [
        (np.where(y == 0, row > 0, row < hats.rows) & np.where(x == 0, column > 0, column < hats.columns))
        for y in range(_HALVES)
        for x in range(_HALVES)
    ]
    matrix = np.zeros((3, hats.nodes, 3, hats.nodes))
    for i, own in enumerate(halves):
        for j, other in enumerate(halves):
            both = own[:, None] & other[None, :]
            for a in AXES:
                for b in AXES:
                    matrix[a, :, b] += both * table[a, i, b, j][down, across]
    return matrix.reshape(3 * hats.nodes, 3 * hats.nodes)


def _table(hats: HatGrid, poisson: float, mesh: Mesh) -> NDArray[np.float64]:
    """Return (3, 4, 3, 4, period_y, period_x): work of a half hat on what one that many intervals away moves."""
    along = [products(meshes.interval(pitch)) for pitch in (hats.pitch_x, hats.pitch_y)]
    through = Line(products(meshes.depth(mesh)), 3 * [slice(None, -1)])
    layers = nodes_of(meshes.depth(mesh)) - 1
    size = _HALVES * _HALVES * len(AXES)
    waves = np.zeros((size, size, hats.period_y, hats.period_x // 2 + 1), complex)
    mirror, sign = _mirrored_in_y()
    for ky in range(hats.period_y // 2 + 1):
        y, down = _wave(along[1], hats.pitch_y, 2 * np.pi * ky / hats.period_y)
        for kx in range(hats.period_x // 2 + 1):
            x, across = _wave(along[0], hats.pitch_x, 2 * np.pi * kx / hats.period_x)
            work = _work(stiffness((x, y, through), poisson), np.asarray(np.kron(down, across), np.complex128), layers)
            waves[:, :, -ky, kx] = sign[:, None] * work[np.ix_(mirror, mirror)] * sign
            waves[:, :, ky, kx] = work
    table = np.fft.irfft2(waves, s=(hats.period_y, hats.period_x))
    return table.reshape(3, 4, 3, 4, hats.period_y, hats.period_x)


def _mirrored_in_y() -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return which half hat a reflection of y puts into the place of each, and the sign of its motion."""
    number = np.arange(len(AXES) * _HALVES * _HALVES).reshape(len(AXES), _HALVES, _HALVES)
    sign = np.ones(number.shape)
    sign[1] = -1
    return number[:, ::-1].ravel(), sign.ravel()


def _wave(along: Products, pitch: float, phase: float) -> tuple[Line, NDArray[np.complex128]]:
    """Return the products, and the loads (2, nodes) of a hat's halves, for motions that gain `phase` an interval."""
    edges = meshes.interval(pitch)
    nodes = nodes_of(edges) - 1
    fold = np.eye(nodes + 1, nodes, dtype=complex)
    fold[nodes, 0] = np.exp(1j * phase)

    def folded(tables: dict[tuple[int, int], Any]) -> dict[tuple[int, int], Any]:
        from scipy import sparse

        back, forth = sparse.csr_matrix(fold.conj().T), sparse.csr_matrix(fold)
        return {key: back @ table @ forth for key, table in tables.items()}

    none = np.zeros(0)
    rise = load(edges, lambda at: at / pitch, none) * np.exp(1j * phase)  # in the interval before
    fall = load(edges, lambda at: 1 - at / pitch, none)
    halves = np.asarray(np.stack([rise, fall]) @ fold.conj(), np.complex128)
    return Line(Products(folded(along.exact), folded(along.reduced))), halves


def _work(matrix: Any, on_surface: NDArray[np.complex128], layers: int) -> NDArray[np.complex128]:
    """Return F^H A^-1 F for loads (4, nodes of a surface), each along x, y and z."""
    from scipy.sparse.linalg import splu

    count, nodes = on_surface.shape
    loads = np.zeros((3, layers, nodes, 3, count), complex)
    for d in AXES:
        loads[d, 0, :, d] = on_surface.T
    flat = loads.reshape(-1, 3 * count)
    return np.asarray(flat.conj().T @ splu(matrix.tocsc()).solve(flat))
