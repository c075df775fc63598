"""Solve given tractions on the pad directly, and compare: `cd tests && python -m mocks.gel.pad_reference --help`.

Independent of the product: elements by scikit-fem, on another mesh (a third of a hat wide and less), no hats, no layer.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import skfem
from lsds_research.pad.fem.solver import Factors
from mocks.gel.pad_loads import HEIGHT_MM, LOADS, THICKNESS_MM, TRACTION_PA, WIDTH_MM, X_MM, Y_MM, errors, product_um
from skfem.helpers import ddot, div, sym_grad

STORED = Path(__file__).with_suffix(".json")
MODULUS_PA = 0.2e6
LAYERS = (0.03, 0.1, 0.28, 0.6, 0.85, 0.75, 0.55, 0.36, 0.22, 0.12)
"""From the base to the surface, in any unit."""
WALL = (0.1, 0.22)
"""Parts of the last element before a wall, from the wall on, in mm; the rest is what is left."""


def edges_mm(size, pitch):
    """Return edges from the middle to the wall: `pitch` apart from the wall on, the first one what is left."""
    from_wall = [0.0, WALL[0], *np.arange(pitch, size / 2 - 1e-6, pitch)]
    return np.array([*(size / 2 - np.array(from_wall)), 0.0])[::-1]


def quarters():
    """Return a rule of 3 x 3 Gauss points on each quarter of a square: exact for loads that end halfway."""
    place, weight = np.polynomial.legendre.leggauss(3)
    place, weight = np.concatenate([place + 1, place + 3]) / 4, np.tile(weight, 2) / 4
    x, y = np.meshgrid(place, place)
    return np.stack([x.ravel(), y.ravel()]), np.outer(weight, weight).ravel()


def reference_um(poisson, pitch_mm=0.32, loads=LOADS, say=lambda text: None):
    """Return (loads, 2, 7, 9): how far the dots move. Edges of loads lie on elements' edges, or halve elements."""
    z = np.concatenate([[0], np.cumsum(LAYERS)]) * THICKNESS_MM / np.sum(LAYERS)
    mesh = skfem.MeshHex.init_tensor(edges_mm(WIDTH_MM, pitch_mm), edges_mm(HEIGHT_MM, pitch_mm), z)
    brick = skfem.ElementVector(skfem.ElementHex2())
    basis, reduced = (skfem.Basis(mesh, brick, intorder=order) for order in (5, 3))
    shear = MODULUS_PA / (2 * (1 + poisson))
    bulk = MODULUS_PA * poisson / ((1 + poisson) * (1 - 2 * poisson))
    stiffness = skfem.BilinearForm(lambda u, v, w: 2 * shear * ddot(sym_grad(u), sym_grad(v))).assemble(basis)
    stiffness += skfem.BilinearForm(lambda u, v, w: bulk * div(u) * div(v)).assemble(reduced)
    say(f"{stiffness.shape[0]} unknowns")
    surface = mesh.facets_satisfying(lambda x: x[2] > THICKNESS_MM - 1e-6)
    top = skfem.FacetBasis(mesh, brick, facets=surface, quadrature=quarters())
    base = basis.get_dofs(lambda x: x[2] < 1e-6).all()
    mirrors = [basis.get_dofs(lambda x, own=own: x[own] < 1e-6) for own in (0, 1)]
    out = np.zeros((len(loads), 2, len(Y_MM), len(X_MM)))
    for parity in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        sign = np.array([[p * (-1 if d == own else 1) for own, p in enumerate(parity)] for d in range(3)])
        odd = [mirrors[own].all(f"u^{d + 1}") for d in range(3) for own in (0, 1) if sign[d, own] < 0]
        free = np.setdiff1d(np.arange(stiffness.shape[0]), np.concatenate([base, *odd]))
        right = np.stack([_load(top, load, sign[load.direction]) for load in loads.values()], axis=1)
        moved = np.zeros(right.shape)
        with Factors(stiffness[free][:, free].tocsr()) as factors:
            moved[free] = factors.solve(right[free])
        out += _at_dots(basis, moved, sign)
        say(f"parity {parity}")
    return 1e3 * out  # millimetres, tractions in pascal like the modulus


def _load(top, load, sign):
    """Return the load vector of the part of a load that has this parity."""
    left, right, low, high = load.box_mm
    outward = -TRACTION_PA if load.direction == 2 else TRACTION_PA

    def within(x, y):
        return (x > left) & (x < right) & (y > low) & (y < high)

    def traction(v, w):
        x, y = w.x[0], w.x[1]
        both = within(x, y) + sign[0] * within(-x, y) + sign[1] * within(x, -y) + sign[0] * sign[1] * within(-x, -y)
        return 0.25 * outward * both * v[load.direction]

    return skfem.LinearForm(traction).assemble(top)


def _at_dots(basis, moved, sign):
    """Return (loads, 2, 7, 9): the motion of the dots, mirrored where they are beyond a mirror."""
    x, y = np.meshgrid(X_MM, Y_MM)
    # Points on the very edge of an element are not always found in one.
    points = np.stack([np.abs(x).ravel() + 1e-7, np.abs(y).ravel() + 1e-7, np.full(x.size, THICKNESS_MM - 1e-7)])
    there = (basis.probes(points) @ moved).reshape(3, x.size, -1)
    flip = np.where(x < 0, sign[:, 0, None, None], 1) * np.where(y < 0, sign[:, 1, None, None], 1)
    return np.moveaxis(there[:2].reshape(2, *x.shape, -1) * flip[:2, ..., None], -1, 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poisson", type=float, default=0.48)
    parser.add_argument("--pitch-mm", type=float, default=0.32, help="0.32, 0.48 or 0.96: what loads' edges fit")
    parser.add_argument("--stored", action="store_true", help="compare with the stored solution, and do not solve")
    parser.add_argument("--store", action="store_true", help=f"write the solution to {STORED.name}")
    arguments = parser.parse_args()
    stored = json.loads(STORED.read_text(encoding="utf-8")) if STORED.exists() else {}
    key = f"{arguments.poisson:g}"
    if arguments.stored:
        solved = np.array(stored[key])
    else:
        solved = reference_um(arguments.poisson, arguments.pitch_mm, say=print)
    if arguments.store:
        stored[key] = np.round(solved, 5).tolist()
        STORED.write_text(json.dumps(stored, separators=(",", ":")) + "\n", encoding="utf-8")
    most = np.hypot(solved[:, 0], solved[:, 1]).max(axis=(1, 2))
    print("load of 1 kPa                            most um   error %, cells of 0.48 and 0.24 mm")
    both = [errors(product_um(arguments.poisson, fine), solved) for fine in (2, 4)]
    for name, motion, coarse, fine in zip(LOADS, most, *both, strict=True):
        print(f"{name:38s} {motion:9.4f} {100 * coarse:9.3f} {100 * fine:9.3f}")


if __name__ == "__main__":
    main()
