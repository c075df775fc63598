"""The undeformed gel: one clean image out of several, and the grid of dots on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds.contracts import Frame, MarkerReference
from lsds.errors import DataError
from lsds.tactile.dots import find_dots
from lsds.tactile.grid import identify_grid

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds.tactile.views import FrameViews

#: Fewer dots than this make no field: divergence and curl would rest on a handful of differences.
FEWEST_DOTS = 12
#: Pads as GelSight prints them for the Mini, (rows, columns). A reference that shows exactly one of them, and no dot
#: cut by the border, is taken for the whole pad.
PRINTED_PADS = ((7, 9), (8, 10))


#: Frames whose brightness differs by more than this share do not belong to one settled stream.
SETTLED = 0.02


class ReferenceCollector:
    """Gathers untouched frames until enough of them in a row are equally bright.

    Cameras open dim and settle over the first frames; a reference with such frames in it would show a contact that is
    not there, all over the gel.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._brightness = 0.0
        self.frames: list[Frame] = []

    def add(self, frame: Frame) -> bool:
        """Take a frame; return whether there are enough."""
        brightness = float(np.mean(frame.image[::4, ::4]))
        if abs(brightness - self._brightness) > SETTLED * max(brightness, 1.0):
            self.frames.clear()
        self._brightness = brightness
        self.frames.append(frame)
        return len(self.frames) >= self._count


def average_frames(frames: Sequence[Frame]) -> Frame:
    """Return the mean of untouched frames, stamped as the last one; less noise in everything measured against it.

    Raises DataError where there are none or their sizes differ.
    """
    if not frames:
        raise DataError("reference: no frame to take it from (is the sensor streaming?)")
    shapes = {frame.image.shape for frame in frames}
    if len(shapes) > 1:
        raise DataError(f"reference: frames of different sizes {sorted(shapes)} cannot be averaged")
    total = np.zeros(frames[0].image.shape, np.float32)
    for frame in frames:
        total += frame.image
    mean = np.rint(total / len(frames)).astype(np.uint8)
    return Frame(mean, frames[-1].t_ns, frames[-1].seq)


@dataclass(frozen=True, slots=True)
class Pad:
    """What the reference frame shows: the grid, the dots' diameter in pixels, and whether that is the whole pad."""

    reference: MarkerReference
    diameter_px: float
    complete: bool


def find_reference(views: FrameViews, pad: tuple[int, int] | None = None) -> Pad:
    """Return the grid of dots on an undeformed frame; `pad` (rows, columns) as printed, where that is known.

    Dots cut by the image border are left out: their centres cannot be measured. Raises DataError where fewer than
    `FEWEST_DOTS` form a grid.
    """
    dots = find_dots(views.dark)
    xy = dots.xy_px[dots.whole]
    grid = identify_grid(xy)
    found = 0 if grid is None else len(grid.index)
    if grid is None or found < FEWEST_DOTS:
        raise DataError(
            f"reference frame {views.frame.seq}: {found} dots form a grid, at least {FEWEST_DOTS} are needed "
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
