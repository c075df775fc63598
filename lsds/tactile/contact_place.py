"""Position of the contact on the pad: at the edge it carries little, turns easily, and is only partly visible."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lsds.contracts import ContactPatch

LEAST_PLACED_SHARE = 0.02
"""Minimum share of the pad in contact; a smaller one may be relief or noise, so it has no position."""
EDGE_SHARE = 0.3
"""Distance of the contact's centre from the pad's beyond which it is at the edge, as a share of width or height."""


def off_centre(contact: ContactPatch | None) -> tuple[float, float]:
    """Return how far the contact's centre of depth is right of and below the pad's, as shares of width and height.

    Depth counts from half of the contact's mean depth on: of a face that is pressed in about as deep as the threshold,
    only a few spots exceed that. (0, 0) if the imprint does not show the contact, as for a flat face that covers the
    pad.
    """
    if contact is None or contact.area_fraction < LEAST_PLACED_SHARE:
        return 0.0, 0.0
    depth = contact.depth_m.astype(np.float64)
    in_contact = depth > contact.threshold_m
    if not in_contact.any():
        return 0.0, 0.0
    depth = np.clip(depth - 0.5 * depth[in_contact].mean(), 0.0, None)
    total = float(depth.sum())
    if not total > 0:
        return 0.0, 0.0
    rows, columns = depth.shape
    x = float(depth.sum(axis=0) @ np.linspace(-0.5, 0.5, columns)) / total
    y = float(depth.sum(axis=1) @ np.linspace(-0.5, 0.5, rows)) / total
    return x, y


def edge_of(contact: ContactPatch | None) -> str:
    """Return the edge of the pad that the contact is at: "right", "left", "lower" or "upper"; empty for none."""
    x, y = off_centre(contact)
    if max(abs(x), abs(y)) <= EDGE_SHARE:
        return ""
    if abs(x) >= abs(y):
        return "right" if x > 0 else "left"
    return "lower" if y > 0 else "upper"
