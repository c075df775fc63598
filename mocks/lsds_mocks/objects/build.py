"""Builds an object's surface from its specification."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.shapes import Box, Cylinder, Sphere
from lsds_mocks.objects.relief import MAP_PITCH_M, Relief, bumps, pores, weave

if TYPE_CHECKING:
    from lsds_mocks.gel.shapes import Shape
    from lsds_mocks.objects.catalogue import ObjectSpec

_OPEN_SHARE = 0.6
"""Fraction of a sponge's surface that is open pores."""


def build_shape(spec: ObjectSpec, length_m: float, rng: np.random.Generator) -> Shape:
    """Return an object's surface under a pad of length `length_m`; `rng` draws its texture."""
    angle = float(np.deg2rad(spec.turned_deg))
    shape: Shape
    if spec.shape == "sphere":
        shape = Sphere(spec.diameter_mm * 0.5e-3)
    elif spec.shape == "cylinder":
        shape = Cylinder(spec.diameter_mm * 0.5e-3, length_m, angle)
    elif spec.shape == "edge":
        shape = Cylinder(spec.edge_mm * 1e-3, length_m, angle)
    else:
        # The plant models the object's ends, because the covered part of the pad changes as the object slides.
        shape = Box(spec.width_mm * 1e-3, _ENDLESS_M, spec.edge_mm * 1e-3, angle)
    if spec.texture == "smooth":
        return shape
    size, depth = spec.texture_size_mm * 1e-3, spec.texture_depth_mm * 1e-3
    if spec.texture == "pores":
        relief = pores(rng, size_m=size, depth_m=depth, open_share=_OPEN_SHARE)
    elif spec.texture == "bumps":
        relief = bumps(rng, size_m=size, depth_m=depth)
    else:
        relief = weave(period_m=size, depth_m=depth)
    return Relief(shape, relief, MAP_PITCH_M)


_ENDLESS_M = 10.0
"""Length of a box's face, m: longer than any pad, because the plant models the object's ends."""
