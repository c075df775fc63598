"""Load of a finger: shear force, torque and normal force of the contact, and the force that is equivalent to them.

Shear: a gel layer that is thin compared with the contact resists shear like a bed of springs: traction = (G / h) u,
with shear modulus G, thickness h and displacement u. Over a regular grid of markers the force is the sum of their
displacements times (G / h) and the area of a grid cell. In simulation, round and flat contacts differ by some 12 % from
the mean.

Normal force: a layer that is thin against the contact also resists pressing like a bed of springs, so N = K V, with
stiffness K of an area and overlap volume V of gel and object. The depth map shows too much of V: the gel dips next to a
contact, and wear and light look like shallow ones. The effective volume S2^2 / S3, of the integrals S2 and S3 of depth
squared and cubed over the pad, weights deep places more; for a flat dent it is V. K was fitted on random objects
(`lsds_research.studies.grip.fit_normal`). There is no estimate for flat faces that cover the pad and leave no imprint,
nor for a small and deep contact, which is that of a soft object.

Equivalent force: a soft finger holds a force F and a torque M about its normal while (F / F0)^2 + (M / (c F0))^2 < 1,
with the friction limit F0 of a pure force (Howe and Cutkosky's ellipse for the limit surface). So sqrt(F^2 + (M / c)^2)
replaces the force, and v + c |w| the speed. The arm c follows from the pressure distribution: 0.59 a for a round
contact of radius a, L / 4 for a line. One value serves all objects: that of a pipe or a plank (5.2 mm when these turn
in the simulated grip). An error of c weights force and torque wrongly, but cancels if the same load slips again.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.contracts.values import ContactLoad
from lsds.tactile.lost_markers import fill_lost
from lsds.tactile.plane_motion import as_complex

if TYPE_CHECKING:
    from lsds.contracts import ContactPatch, DeformationField, SlipEstimate
    from lsds.tactile.lost_markers import FilledField

SHEAR_SHARE = 0.12
"""Relative standard deviation of the load between objects."""
DOT_M = 2e-6
"""Standard deviation of one marker's displacement, m."""
LEAST_VALID_SHARE = 0.5
"""Minimum share of valid markers; with fewer, no load is estimated."""
PRESSED_N_M3 = 1.47e8
"""Stiffness K of an area of a GelSight Mini's gel, N/m^3; fitted."""
NORMAL_STD_SHARE = 0.15
"""Relative standard deviation of the estimate."""
LEAST_PRESSED_SHARE = 0.03
"""Minimum share of the pad in contact; a smaller contact has no estimate."""
SMALL_SHARE = 0.05
"""Share of the pad below which a deep contact is that of a soft object and has no estimate."""
DEEP_M = 2.5e-4
"""Mean depth above which a contact is deep, m."""
FRICTION_ARM_M = 5e-3
"""Arm c of friction against turning."""


def load_of(
    field: DeformationField,
    metres_per_px: float,
    shear_n_m3: float,
    normal: tuple[float, float] | None = None,
    filled: FilledField | None = None,
) -> ContactLoad | None:
    """Return the force and torque that the object exerts on the gel since the reference; None with too few markers.

    `shear_n_m3` is (G / h), in the config `tactile.shear_kpa_mm`. `normal` is the normal force and its one sigma (N).
    `filled` is the field without holes (`fill_lost`), if the caller knows it: a press spreads the markers, so that the
    mean of those that are left says little of the lost ones.

    Pressing alone spreads the markers. Off the pad's centre this looks like shear, so subtract the load of a frame in
    which the grip has settled and nothing is lifted (`ContactLoad.since`).
    """
    valid = field.valid
    known, count = int(np.count_nonzero(valid)), len(valid)
    if known < max(LEAST_VALID_SHARE * count, 3):
        return None
    pitch_x, pitch_y = field.reference.pitch_px
    per_m = shear_n_m3 * pitch_x * pitch_y * metres_per_px**2
    displacement_m, scatter_m = field.displacement_m, 0.0
    if known < count:
        filled = filled or fill_lost(field)
        displacement_m, scatter_m = filled.displacement_m, filled.scatter_m
    moved, at = as_complex(displacement_m), as_complex(field.position_m)
    total = complex(moved.sum())
    x, y = per_m * total.real, per_m * total.imag
    torque = per_m * float(np.vdot(at, moved).imag)
    noise_n = per_m * math.hypot(DOT_M * math.sqrt(count), scatter_m * math.sqrt(count - known))
    arm_m = math.sqrt(float(np.vdot(at, at).real) / count)
    return ContactLoad(
        (x, y),
        torque,
        math.hypot(noise_n, SHEAR_SHARE * math.hypot(x, y)),
        math.hypot(noise_n * arm_m, SHEAR_SHARE * torque),
        *(normal or ()),
    )


def normal_force_of(contact: ContactPatch | None, pad_m2: float) -> tuple[float, float] | None:
    """Return normal force and one sigma (N) from the contact patch on a pad of `pad_m2`; None without an estimate."""
    if contact is None or contact.area_fraction < LEAST_PRESSED_SHARE:
        return None
    depth_m = contact.depth_m.clip(min=0.0).ravel()
    if contact.area_fraction < SMALL_SHARE and float(depth_m.mean()) > DEEP_M * contact.area_fraction:
        return None
    # Sums as dot products take a third of the time of means.
    squared, cubed = float(depth_m @ depth_m), float((depth_m * depth_m) @ depth_m)
    force_n = PRESSED_N_M3 * pad_m2 * squared**2 / (cubed * depth_m.size)
    return force_n, NORMAL_STD_SHARE * force_n


def pull_of(load: ContactLoad) -> float:
    """Return the equivalent force (N): the pure force that is equally near to the friction limit."""
    return math.hypot(load.force_n, load.torque_nm / FRICTION_ARM_M)


def speed_of(estimate: SlipEstimate) -> tuple[float, float]:
    """Return the equivalent slip speed, rotation included, and one sigma (m/s); NaN if the estimator abstains."""
    speed, std = estimate.speed_m_s, estimate.speed_std_m_s
    if math.isfinite(estimate.angular_rad_s):
        speed += FRICTION_ARM_M * abs(estimate.angular_rad_s)
    if math.isfinite(estimate.angular_std_rad_s):
        std = math.hypot(std, FRICTION_ARM_M * estimate.angular_std_rad_s)
    return speed, std
