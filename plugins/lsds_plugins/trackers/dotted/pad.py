"""The printed pad as the reference frame shows it: the grid of dots, and whether that is all of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds.contracts import MarkerReference
from lsds.errors import DataError
from lsds_plugins.trackers.dotted.find_dots import find_dots
from lsds_plugins.trackers.dotted.grid import identify_grid

if TYPE_CHECKING:
    from lsds.tactile.views import ViewedFrame

#: Least number of dots of a field: with fewer, divergence and curl would depend on a handful of differences.
FEWEST_DOTS = 12
#: Pads as GelSight prints them for the Mini, (rows, columns). A reference that shows exactly one of them, and no dot
#: cut by the border, is taken for the whole pad.
PRINTED_PADS = ((7, 9), (8, 10))


@dataclass(frozen=True, slots=True)
class Pad:
    """The pad in the reference frame: the grid, the dots' diameter in pixels, and whether the grid is complete."""

    reference: MarkerReference
    diameter_px: float
    complete: bool


def find_reference(views: ViewedFrame, pad: tuple[int, int] | None = None) -> Pad:
    """Return the grid of dots on an undeformed frame; `pad` is the printed grid (rows, columns), if known.

    Dots cut by the image border are left out: their centres cannot be measured. Raises DataError if fewer than
    `FEWEST_DOTS` form a grid.
    """
    dots = find_dots(views.dark)
    xy = dots.xy_px[dots.whole]
    grid = identify_grid(xy)
    found = 0 if grid is None else len(grid.index)
    if grid is None or found < FEWEST_DOTS:
        raise DataError(
            f"reference frame {views.seq}: {found} dots form a grid, at least {FEWEST_DOTS} are needed "
            "(is this a gel with printed dots, untouched and lit? for a gel without dots use tracker 'dis')"
        )
    order = np.lexsort((grid.cell[:, 1], grid.cell[:, 0]))
    height, width = views.grey.shape
    reference = MarkerReference(
        xy[grid.index][order], grid.cell[order], grid.shape, grid.pitch_px, grid.axes, (width, height)
    )
    full = found == grid.shape[0] * grid.shape[1]
    complete = full and (grid.shape == pad or (pad is None and grid.shape in PRINTED_PADS and bool(dots.whole.all())))
    return Pad(reference, dots.diameter_px, complete)
