"""What slip leaves in the velocity field, told apart from sticking, pressing and jitter.

A gel carried along by a sticking object moves smoothly: as a rigid body, or sheared and stretched evenly, or with a
gentle bend. A sliding surface lets go of the markers one by one, so each deviates from the best smooth motion; and it
does so along the shear that friction holds up. Pressing harder also bends the field, but in all directions alike, and
so does the tracker's jitter. The part of the residual along the shear, less the part across it, is what slip adds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from lsds.tactile.contact_markers import markers_in_contact
from lsds.tactile.plane_motion import as_complex, rigid, smooth_residual

if TYPE_CHECKING:
    from lsds.contracts import Observation

Motion = Literal["rigid", "affine", "quadratic"]


@dataclass(frozen=True, slots=True)
class SlipResidual:
    """One frame's evidence, SI units. `along` and `across` are mean squares (m/s)^2 of the residual velocity.

    `translation` (m/s, squared) and `rim` (m/s, squared: rotation at the radius of gyration `radius_m`) are those of
    the best rigid motion of the velocities; `shear_m` (x, y) and `twist_rad` those of the displacements, that is what
    friction holds up. `markers` is how many it rests on.
    """

    along: float
    across: float
    translation: float
    rim: float
    shear_m: tuple[float, float]
    twist_rad: float
    radius_m: float
    markers: int

    @property
    def excess(self) -> float:
        """Mean square (m/s)^2 of the residual along the shear beyond that across it, zero or more."""
        return max(0.0, self.along - self.across)


_last: tuple[Observation, Motion, int, SlipResidual | None] | None = None


def slip_residual(observation: Observation, motion: Motion = "quadratic", least: int = 6) -> SlipResidual | None:
    """Return the frame's evidence from the markers in contact; None with fewer than `least` of them or no velocity.

    The last answer is kept: detector and estimator ask the same of each frame.
    """
    global _last
    if _last is None or _last[0] is not observation or _last[1:3] != (motion, least):
        _last = (observation, motion, least, _evidence(observation, motion, least))
    return _last[3]


def _evidence(observation: Observation, motion: Motion, least: int) -> SlipResidual | None:
    field = observation.field
    chosen = markers_in_contact(observation, least)
    velocity = as_complex(field.velocity_m_s)
    if not field.valid.all() or np.isnan(velocity[0]):
        chosen = chosen & ~np.isnan(velocity)
    count = int(np.count_nonzero(chosen))
    if count < least:
        return None
    position, velocity = as_complex(field.position_m)[chosen], velocity[chosen]
    held = rigid(position, as_complex(field.displacement_m)[chosen])
    moving = rigid(position, velocity)
    if held is None or moving is None:
        return None
    residual = moving.residual if motion == "rigid" else smooth_residual(moving.offset, velocity, motion)
    # Direction of the shear at each marker: translation and twist of the displacements, without the press's spread.
    shear = held.motion
    along = (residual * shear.conj()).real / np.maximum(np.abs(shear), 1e-12)
    along_square = float(along @ along) / count
    total = float(np.vdot(residual, residual).real) / count
    return SlipResidual(
        along_square,
        max(0.0, total - along_square),
        abs(moving.translation) ** 2,
        (moving.radius * moving.rotation) ** 2,
        (held.translation.real, held.translation.imag),
        held.rotation,
        moving.radius,
        count,
    )


def confidence(score: float, threshold: float) -> float:
    """Return how far a score is from its threshold, in [0, 1]: 0 at it, 0.8 a factor of two away."""
    return 1.0 - math.pow(0.2, abs(math.log2(max(score, 1e-12) / threshold)))
