"""The shape of the gel's surface under and around a rigid object, for the optics and for the truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.material import CONTACT_LEVEL

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.shapes import Shape
    from lsds_mocks.gel.state import GelState

SHOULDER = 0.05
"""Width of the smooth transition from the object to the free gel, as part of the indentation."""


def surface_depth(
    shape: Shape, state: GelState, x_m: NDArray[np.float64], y_m: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Depth (H, W) in metres: the object's own surface in contact, a smooth shoulder around it.

    Depth = (o + sqrt(o^2 + 4 s^2)) / 2, a soft maximum of the overlap o and zero that never rises above the flat gel.
    """
    depth = np.zeros((len(y_m), len(x_m)), np.float32)
    if state.indentation_m <= 0:
        return depth
    overlap = state.indentation_m - shape.gap(x_m[None, :], y_m[:, None])
    depth += 0.5 * (overlap + np.sqrt(overlap * overlap + (2 * SHOULDER * state.indentation_m) ** 2))
    if state.reach_m is not None:
        depth *= ((y_m >= state.reach_m[0]) & (y_m <= state.reach_m[1])).astype(np.float32)[:, None]
    return depth


def contact_fraction(shape: Shape, state: GelState, width_m: float, height_m: float) -> float:
    """Fraction of a centred window where gap < contact level x indentation, sampled on 160 x 120 points."""
    if state.indentation_m <= 0:
        return 0.0
    x = ((np.arange(160) + 0.5) / 160 - 0.5) * width_m
    y = ((np.arange(120) + 0.5) / 120 - 0.5) * height_m
    touching = shape.gap(x[None, :], y[:, None]) < CONTACT_LEVEL * state.indentation_m
    touching = np.broadcast_to(touching, (120, 160))
    if state.reach_m is not None:
        touching = touching & ((y >= state.reach_m[0]) & (y <= state.reach_m[1]))[:, None]
    return float(touching.mean())
