"""Quadratic elements along one axis. Bricks on a tensor grid are products of three of these.

An integral over bricks of products of derivatives is the Kronecker product of integrals along x, y and z, with any rule
of Gauss points; so a pad's stiffness needs no loop over its elements.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

ORDER = 2
"""Of the elements' polynomials."""
_REFERENCE = np.linspace(0.0, 1.0, ORDER + 1)
_SHAPE_POINTS = 3
"""Points that integrate a shape function times a straight line exactly."""


@dataclass(frozen=True, eq=False)
class Products:
    """Integrals of shape functions along an axis: `exact[p, q]` and `reduced[p, q]`, sparse, of the p-th derivative of
    a row's and the q-th of a column's function, by three Gauss points in an element and by two."""

    exact: dict[tuple[int, int], Any]
    reduced: dict[tuple[int, int], Any]


def element(place: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return values and slopes (3, N) of the shape functions at places (N,) in an element that reaches from 0 to 1."""
    values, slopes = np.empty((ORDER + 1, len(place))), np.empty((ORDER + 1, len(place)))
    for own, node in enumerate(_REFERENCE):
        others = np.poly(np.delete(_REFERENCE, own))
        scale = np.polyval(others, node)
        values[own] = np.polyval(others, place) / scale
        slopes[own] = np.polyval(np.polyder(others), place) / scale
    return values, slopes


def nodes_of(edges: NDArray[np.float64]) -> int:
    """Return the number of nodes of the elements between these edges."""
    return ORDER * (len(edges) - 1) + 1


def products(edges: NDArray[np.float64]) -> Products:
    """Return the integrals over the elements between `edges` (N + 1,)."""
    return Products(_products(edges, ORDER + 1), _products(edges, ORDER))


def _products(edges: NDArray[np.float64], points: int) -> dict[tuple[int, int], Any]:
    from scipy import sparse

    place, weight = _gauss(points)
    shape = element(place)
    local = ORDER * np.arange(len(edges) - 1)[:, None] + np.arange(ORDER + 1)
    rows, columns = np.repeat(local, ORDER + 1, axis=1), np.tile(local, ORDER + 1)
    size = np.diff(edges)
    found = {}
    for p, q in product((0, 1), (0, 1)):
        one = ((shape[p] * weight) @ shape[q].T).ravel()
        value = size[:, None] ** (1 - p - q) * one
        found[p, q] = sparse.csr_matrix(
            (value.ravel(), (rows.ravel(), columns.ravel())), shape=(nodes_of(edges), nodes_of(edges))
        )
    return found


def load(
    edges: NDArray[np.float64],
    density: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    kinks: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return (nodes,) the integral of each shape function times a density that is straight between its kinks."""
    inside = kinks[(kinks > edges[0]) & (kinks < edges[-1])]
    cuts = np.unique(np.concatenate([edges, inside]))
    low, high = cuts[:-1], cuts[1:]
    number = np.searchsorted(edges, 0.5 * (low + high)) - 1
    start, size = edges[number], np.diff(edges)[number]
    place, weight = _gauss(_SHAPE_POINTS)
    at = low[:, None] + (high - low)[:, None] * place
    values, _ = element(((at - start[:, None]) / size[:, None]).ravel())
    share = (density(at) * weight * (high - low)[:, None]).ravel()
    out = np.zeros(nodes_of(edges))
    for own in range(ORDER + 1):
        np.add.at(out, np.repeat(ORDER * number + own, _SHAPE_POINTS), values[own] * share)
    return out


def hat(edges: NDArray[np.float64], centre: float, pitch: float) -> NDArray[np.float64]:
    """Return (nodes,) the load of a hat, as far as it lies on the axis."""
    return load(
        edges, lambda at: np.maximum(1 - np.abs(at - centre) / pitch, 0), centre + pitch * np.array([-1.0, 0.0, 1.0])
    )


def _gauss(points: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    place, weight = np.polynomial.legendre.leggauss(points)
    return np.asarray(0.5 * (place + 1)), np.asarray(0.5 * weight)
