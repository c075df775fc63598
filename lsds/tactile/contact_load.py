"""Load of a finger: shear force and torque of the contact, from the displacement of the markers.

A gel layer that is thin compared with the contact resists shear like a bed of springs: traction = (G / h) u, with shear
modulus G, thickness h and displacement u. Over a regular grid of markers the force is the sum of their displacements
times (G / h) and the area of a grid cell. In simulation, round and flat contacts differ by some 12 % from the mean.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.contracts.values import ContactLoad
from lsds.tactile.plane_motion import as_complex

if TYPE_CHECKING:
    from lsds.contracts import DeformationField

SHEAR_SHARE = 0.12
"""Relative standard deviation of the load between objects."""
DOT_M = 2e-6
"""Standard deviation of one marker's displacement, m."""
LEAST_VALID_SHARE = 0.5
"""Minimum share of valid markers; with fewer, no load is estimated."""


def load_of(
    field: DeformationField, metres_per_px: float, shear_n_m3: float, normal: tuple[float, float] | None = None
) -> ContactLoad | None:
    """Return the force and torque that the object exerts on the gel since the reference; None with too few markers.

    `shear_n_m3` is (G / h), in the config `tactile.shear_kpa_mm`. `normal` is the normal force and its one sigma (N).

    Pressing alone spreads the markers. Off the pad's centre this looks like shear, so subtract the load of a frame in
    which the grip has settled and nothing is lifted (`ContactLoad.since`).
    """
    valid = field.valid
    known, count = int(np.count_nonzero(valid)), len(valid)
    if known < max(LEAST_VALID_SHARE * count, 3):
        return None
    pitch_x, pitch_y = field.reference.pitch_px
    # A lost marker counts as the mean of the others.
    per_m = shear_n_m3 * pitch_x * pitch_y * metres_per_px**2 * count / known
    moved, at = as_complex(field.displacement_m)[valid], as_complex(field.position_m)[valid]
    total = complex(moved.sum())
    x, y = per_m * total.real, per_m * total.imag
    torque = per_m * float(np.vdot(at, moved).imag)
    noise_n = per_m * DOT_M * math.sqrt(known)
    arm_m = math.sqrt(float(np.vdot(at, at).real) / known)
    return ContactLoad(
        (x, y),
        torque,
        math.hypot(noise_n, SHEAR_SHARE * math.hypot(x, y)),
        math.hypot(noise_n * arm_m, SHEAR_SHARE * torque),
        *(normal or ()),
    )
