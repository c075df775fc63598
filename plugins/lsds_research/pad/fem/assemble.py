"""From finite elements to a file: pad less layer, between hats, as coefficients of hats."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from lsds_mocks.gel.field.correction import CorrectionFile, pack, unpack

from lsds import __version__
from lsds_research.pad.fem.layer_hats import layer_matrix
from lsds_research.pad.fem.mesh import PER_HAT
from lsds_research.pad.fem.pad_hats import pad_classes
from lsds_research.pad.fem.solver import require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds_mocks.gel.field.grid import HatGrid
    from numpy.typing import NDArray

    from lsds_research.pad.fem.mesh import Mesh
    from lsds_research.pad.fem.pad_hats import Progress

_LAYER = 0.1
"""Part of a ratio's time that the layer takes, for the progress bar."""


def make(hats: HatGrid, ratios: Sequence[float], mesh: Mesh, progress: Progress) -> CorrectionFile:
    """Compute the corrections for some Poisson ratios; `progress` is called with parts that add up to 1.

    Raises LsdsError if SciPy is missing.
    """
    require()
    found = []
    for poisson in ratios:
        pad = pad_classes(hats, poisson, mesh, lambda part: progress((1 - _LAYER) * part / len(ratios)))
        layer = layer_matrix(hats, poisson, mesh)
        progress(_LAYER / len(ratios))
        found.append(correction(hats, pad, layer))
    return CorrectionFile(hats, np.array(ratios), np.array(found, np.float32), provenance(hats, mesh))


def correction(hats: HatGrid, pad: Sequence[NDArray[np.float64]], layer: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the classes (4, m (m + 1) / 2) of a correction, from the hats' work on the pad, in classes of parity
    (m, m), and on the layer (3 nodes, 3 nodes)."""
    triangles = np.array([square[np.triu_indices(len(square))] for square in pad])
    work = unpack(hats, triangles).reshape(layer.shape) - layer
    return pack(hats, project(hats, work))


def project(hats: HatGrid, work: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return M^-1 D M^-1 for the hats' mass matrix M: the field on hats whose work on every hat is that given.

    It is the best fit in the mean, exact for loads made of hats. Dividing by the hats' areas instead smears what is
    curved over a hat: several per cent for loads near a wall.
    """
    across = np.linalg.inv(_mass(hats.columns, hats.pitch_x))
    down = np.linalg.inv(_mass(hats.rows, hats.pitch_y))
    fitted = work.reshape(2 * (3, hats.rows + 1, hats.columns + 1))
    for axis, inverse in ((1, down), (2, across), (4, down), (5, across)):
        fitted = np.moveaxis(np.tensordot(inverse, fitted, axes=(1, axis)), 0, axis)
    return np.asarray(fitted.reshape(work.shape))


def _mass(intervals: int, pitch: float) -> NDArray[np.float64]:
    """Return (hats, hats): integrals of products of hats along an axis; those at the walls are halves."""
    whole = np.full(intervals + 1, 4.0)
    whole[[0, -1]] = 2.0
    beside = np.ones(intervals)
    return (np.diag(whole) + np.diag(beside, 1) + np.diag(beside, -1)) * (pitch / 6)


def provenance(hats: HatGrid, mesh: Mesh) -> dict[str, Any]:
    """Return the parameters that reproduce a file."""
    import scipy

    return {
        "made by": f"lsds {__version__}, python -m lsds_research.pad.make_pad",
        "quantity": "pad less periodic layer, coefficients of bilinear hats, in 1 / (modulus x thickness)",
        "pad": "linear elastic, bonded to a rigid base, free walls, flat surface",
        "size in thicknesses": [hats.columns * hats.pitch_x, hats.rows * hats.pitch_y],
        "elements": "bricks of 27 nodes on a tensor grid over a quarter of the pad, by classes of parity",
        "integration": "3 x 3 x 3 Gauss points; volumetric term 2 x 2 x 2",
        "elements per hat": PER_HAT,
        "layers, surface to base": list(mesh.layers),
        "parts of the element at a wall": list(mesh.wall),
        "loads": "hats along x, y and into the gel, integrated exactly",
        "layer": "the same elements and hats, by Bloch waves over one hat interval",
        "projection": "inverse mass matrix of the hats, on both sides",
        "solver": require(),
        "versions": {"numpy": np.__version__, "scipy": scipy.__version__},
    }
