"""One tactile image with its markers: dots where they were, arrows to where they are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from lsds.contracts import Frame, MarkerReference, MarkerTracks

#: Arrows are drawn longer than life, or a slip of half a pixel could not be seen.
MAGNIFY = 3.0


def draw_frame(axes: Axes, frame: Frame, reference: MarkerReference, tracks: MarkerTracks | None, title: str) -> None:
    """Draw the image, an arrow per valid marker (magnified), a cross per lost one."""
    # Markers are in px of the working image, which may be smaller than the camera's.
    width, height = reference.image_size
    axes.imshow(frame.image, extent=(-0.5, width - 0.5, height - 0.5, -0.5))
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(title, fontsize=9)
    home = reference.xy_px
    if tracks is None:
        axes.plot(home[:, 0], home[:, 1], "o", ms=3, mfc="none", mec="white", mew=0.7)
        return
    valid = tracks.valid
    moved = (tracks.xy_px - home)[valid]
    if valid.any():
        axes.quiver(
            home[valid, 0],
            home[valid, 1],
            moved[:, 0],
            moved[:, 1],
            angles="xy",
            scale_units="xy",
            scale=1 / MAGNIFY,
            color="yellow",
            width=0.006,
        )
    if not valid.all():
        axes.plot(home[~valid, 0], home[~valid, 1], "x", ms=5, color="red")
    largest = float(np.hypot(moved[:, 0], moved[:, 1]).max()) if len(moved) else 0.0
    axes.set_xlabel(f"arrows x{MAGNIFY:g}; largest {largest:.1f} px; {int(valid.sum())}/{len(valid)} dots", fontsize=8)
