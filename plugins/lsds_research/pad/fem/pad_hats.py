"""Compliance between hats on a pad with a bonded base and free walls, by finite elements on a quarter of it.

The pad's two mirror planes split loads and motions into four classes of parity that do not see each other; on a mirror
plane, a component that is odd under its reflection is zero (see `lsds_mocks.gel.field.correction`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from lsds_mocks.gel.field.correction import PARITIES

from lsds_research.pad.fem import mesh as meshes
from lsds_research.pad.fem.axis import hat, nodes_of, products
from lsds_research.pad.fem.solid import AXES, Line, stiffness
from lsds_research.pad.fem.solver import Factors

if TYPE_CHECKING:
    from lsds_mocks.gel.field.grid import HatGrid
    from numpy.typing import NDArray

    from lsds_research.pad.fem.mesh import Mesh

_LOADS_AT_ONCE = 64
"""Loads solved for together."""
Progress = Callable[[float], object]
"""Called with the part of the whole, 0 to 1, that was just done."""


def pad_classes(hats: HatGrid, poisson: float, mesh: Mesh, progress: Progress) -> list[NDArray[np.float64]]:
    """Return for each class of parity (m, m): work of the hats of a quarter, made whole by their mirror images, on what
    they move; in units of Young's modulus and thickness."""
    edges = (
        meshes.half_pad(mesh, hats.columns, hats.pitch_x),
        meshes.half_pad(mesh, hats.rows, hats.pitch_y),
        meshes.depth(mesh),
    )
    along = [products(e) for e in edges]
    found = []
    for parity in PARITIES:
        odd_x, odd_y = ([sign * (-1 if d == own else 1) < 0 for d in AXES] for own, sign in enumerate(parity))
        x, y = ([slice(int(odd), None) for odd in which] for which in (odd_x, odd_y))
        lines = (Line(along[0], x), Line(along[1], y), Line(along[2], 3 * [slice(None, -1)]))
        across = [_hats(edges[0], hats.columns, hats.pitch_x, odd)[:, k] for odd, k in zip(odd_x, x, strict=True)]
        down = [_hats(edges[1], hats.rows, hats.pitch_y, odd)[:, k] for odd, k in zip(odd_y, y, strict=True)]
        found.append(_work(stiffness(lines, poisson), across, down, nodes_of(edges[2]) - 1, progress))
    return found


def _hats(edges: NDArray[np.float64], count: int, pitch: float, odd: bool) -> NDArray[np.float64]:
    """Return the load vectors (count // 2 + 1, nodes) of the hat functions, from the pad's middle to its wall.

    Each is the sum with its mirror image, or if `odd` the difference from it.
    """
    rows = []
    for place in (np.arange(count // 2 + 1) + 0.5 * (count % 2)) * pitch:
        own = hat(edges, place, pitch)
        if place == 0:
            rows.append(0 * own if odd else own)
        else:
            mirrored = hat(edges, -place, pitch)
            rows.append(own - mirrored if odd else own + mirrored)
    return np.array(rows)


def _work(
    matrix: object,
    across: list[NDArray[np.float64]],
    down: list[NDArray[np.float64]],
    layers: int,
    progress: Progress,
) -> NDArray[np.float64]:
    """Return F^T A^-1 F for the products F of the loads along x and y, on the surface."""
    from scipy import sparse

    loads = sparse.block_diag(
        [
            sparse.vstack(
                [
                    sparse.csr_matrix(np.kron(y.T, x.T)),
                    sparse.csr_matrix(((layers - 1) * x.shape[1] * y.shape[1], len(x) * len(y))),
                ]
            )
            for x, y in zip(across, down, strict=True)
        ],
        format="csc",
    )
    count = sum(len(x) * len(y) for x, y in zip(across, down, strict=True))
    work = np.empty((count, count))
    with Factors(matrix) as factors:
        for first in range(0, count, _LOADS_AT_ONCE):
            some = slice(first, min(first + _LOADS_AT_ONCE, count))
            work[:, some] = loads.T @ factors.solve(loads[:, some].toarray())
            progress((some.stop - some.start) / (count * len(PARITIES)))
    return 0.5 * (work + work.T)
