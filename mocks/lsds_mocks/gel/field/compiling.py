"""One-time preparation of a gel on cells: compiled code and tables, so that a real-time run does not wait for them."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.byte_cache import kept
from lsds_mocks.gel.field.dense import relax
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.gel.field.operator import Kernel, operator
from lsds_mocks.gel.shapes import Box, Sphere
from lsds_mocks.objects.relief import Relief

if TYPE_CHECKING:
    from lsds_mocks.gel.field.operator import Operator
    from lsds_mocks.gel.material import GelMaterial


def prepare(material: GelMaterial, fines: tuple[int, ...], kernel: Kernel = "pad") -> None:
    """Load or compile the code for these grids and fill their tables; print a notice if that takes long.

    Raises DataError if there is no correction for this pad.
    """
    _prepared(material, fines, kernel)


@kept
def _prepared(material: GelMaterial, fines: tuple[int, ...], kernel: Kernel) -> tuple[Operator, ...]:
    """Return the operators; the cache holds them, so operators that it drops are prepared again."""
    cache = relax.stats.cache_path
    if cache is None or not any(Path(cache).glob("dense.relax-*.nbi")):
        print("compiling the simulated gel, once on this machine: some 15 s", file=sys.stderr, flush=True)
    operators = tuple(operator(material, fine, kernel) for fine in fines)
    x_m = np.zeros(2)
    Relief(Box(1.0, 1.0, angle_rad=0.1), np.zeros((2, 2), np.float32), 1e-3).gap(x_m, x_m)
    for solver in ("blocks", "fft"):
        gel = FieldGel(Sphere(material.thickness_m), material, fine=fines[0], kernel=kernel, solver=solver)
        for turn in (1, -1):
            gel.press(0.02 * material.thickness_m)
            gel.set_friction(np.full(gel.points_m.shape[1], 0.5))
            for share in (0.01, 0.011, 0.012):
                gel.trial(share * turn * material.thickness_m, 0.0)
            gel.commit()
            _ = gel.stick_ratio
        gel.displacement_now(np.zeros((1, 2)))
        gel.depth(gel.state(), x_m, x_m)
    return operators
