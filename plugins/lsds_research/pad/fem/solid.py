"""Stiffness of an elastic solid of bricks, as a sum of Kronecker products; lengths in thicknesses, Young's modulus 1.

Near Poisson's ratio 1/2, bricks that are integrated exactly cannot bend without a change of volume
("locking"), which costs them some per cent at 0.48 and more beyond. The volumetric term is therefore integrated by
2 x 2 x 2 Gauss points, the rest by 3 x 3 x 3: selective reduced integration (Malkus and Hughes 1978, Comput. Methods
Appl. Mech. Eng. 15).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds_research.pad.fem.axis import Products

AXES = range(3)
"""x, y, and z into the gel; displacements likewise."""


@dataclass(frozen=True, eq=False)
class Line:
    """One axis of a solid: its products, and which of its nodes each component of the displacement has."""

    products: Products
    kept: Sequence[slice] = 3 * (slice(None),)

    def term(self, reduced: bool, of_row: int, of_column: int, row: int, column: int) -> Any:
        """Return the integral of derivatives `of_row` and `of_column` of the functions of two components."""
        table = self.products.reduced if reduced else self.products.exact
        return table[of_row, of_column][self.kept[row], self.kept[column]]


def stiffness(lines: tuple[Line, Line, Line], poisson: float) -> Any:
    """Return the sparse stiffness; unknowns are numbered by component, then z, then y, then x."""
    from scipy import sparse

    shear = 0.5 / (1 + poisson)
    bulk = poisson / ((1 + poisson) * (1 - 2 * poisson))

    def integral(reduced: bool, d_row: int, d_column: int, row: int, column: int) -> Any:
        """Integrate derivative along `d_row` of component `row` times that along `d_column` of `column`."""
        x, y, z = (
            line.term(reduced, int(axis == d_row), int(axis == d_column), row, column)
            for axis, line in enumerate(lines)
        )
        return sparse.kron(z, sparse.kron(y, x, "csr"), "csr")

    def block(i: int, j: int) -> Any:
        # bulk div v div u + 2 shear e(v) : e(u), v of component i and u of component j.
        part = bulk * integral(True, i, j, i, j) + shear * integral(False, j, i, i, j)
        return part + shear * sum(integral(False, k, k, i, i) for k in AXES) if i == j else part

    return sparse.bmat([[block(i, j) for j in AXES] for i in AXES], "csr")
