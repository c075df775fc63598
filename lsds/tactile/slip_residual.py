"""What slip leaves in the velocity field, told apart from sticking, pressing and jitter.

A gel carried along by a sticking object moves smoothly: as a rigid body, or sheared and stretched evenly, or with a
gentle bend. A sliding surface lets go of the markers one by one, so each deviates from the best smooth motion; and it
does so along the shear that friction holds up. Pressing harder also bends the field, but in all directions alike, and
so does the tracker's jitter. The part of the residual along the shear, less the part across it, is what slip adds.
"""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from lsds.tactile.contact_markers import markers_in_contact
from lsds.tactile.plane_motion import Points, as_complex, smooth_basis

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import DeformationField, Observation

Motion = Literal["rigid", "affine", "quadratic"]


class SlipResidual(NamedTuple):
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


def slip_residual(observation: Observation, motion: Motion = "quadratic", least: int = 6) -> SlipResidual | None:
    """Return the frame's evidence from the markers in contact; None with fewer than `least` of them or no velocity.

    The last answer is kept: detector and estimator ask the same of each frame.
    """
    last = _kept.last
    if last is None or last[0] is not observation or last[1:3] != (motion, least):
        last = _kept.last = (observation, motion, least, _evidence(observation, motion, least))
    return last[3]


def _evidence(observation: Observation, motion: Motion, least: int) -> SlipResidual | None:
    field = observation.field
    chosen = markers_in_contact(observation, least)
    velocity = as_complex(field.velocity_m_s)
    # One product in place of a question each. A dot that was lost in the frame before has no velocity, but is valid.
    if math.isnan(np.vdot(velocity, velocity).real):
        chosen = chosen & ~np.isnan(velocity)
    contact = _contact(field, chosen, motion)
    count = contact.count
    if count < least or contact.points.inertia <= 0:
        return None
    points = contact.points
    velocity = velocity[contact.index]
    # One product gives the rigid motion and the coordinates of the smooth one.
    moved = contact.rows.dot(velocity)
    translation, turned = moved[:2].tolist()
    held, twisted = contact.rigid_rows.dot(as_complex(field.displacement_m)[contact.index]).tolist()
    rotation, twist = turned.imag, twisted.imag
    if contact.minus_basis is None:
        residual = velocity - points.motion(translation, rotation)
    else:
        residual = contact.minus_basis.dot(moved[2:])
        residual += velocity
    # Direction of the shear at each marker: translation and twist of the displacements, without the press's spread;
    # conjugate, so that the product's real part is the residual along it.
    shear = contact.turn * twist
    shear += held.conjugate()
    along = (residual * shear).real
    if held or twist:
        along /= np.abs(shear)
    parts = residual.view(np.float64)
    along_square = contact.square * along.dot(along).item()
    total = contact.square * parts.dot(parts).item()
    return SlipResidual(
        along_square,
        max(0.0, total - along_square),
        translation.real**2 + translation.imag**2,
        (points.radius * rotation) ** 2,
        (held.real, held.imag),
        twist,
        points.radius,
        count,
    )


class _Contact:
    """One choice of markers of a reference and what is linear in their vectors: worked out once for many frames.

    `rows` (2 + terms, n) give translation, rotation (the imaginary part) and the coordinates in the smooth basis, of
    which `minus_basis` (n, terms) is the negative; `rigid_rows` are the first two of them. `turn` (n,) is the conjugate
    of a unit rotation's motion; `square` turns a sum of squared residuals into their mean square.
    """

    __slots__ = ("count", "index", "minus_basis", "points", "rigid_rows", "rows", "square", "turn")

    def __init__(self, field: DeformationField, chosen: NDArray[np.bool_], motion: Motion) -> None:
        self.index = np.flatnonzero(chosen)
        self.count = len(self.index)
        if not self.count:
            return
        self.points = points = Points(as_complex(field.position_m)[self.index])
        self.square = 1.0 / self.count
        rows = [np.full(self.count, 1.0 / self.count), points.offset.conj() / (points.inertia or 1.0)]
        self.minus_basis = None
        if motion != "rigid":
            basis, scale = smooth_basis(points.offset, motion)
            self.minus_basis = -basis.astype(np.complex128)
            self.square *= scale**2
            rows += list(basis.T)
        self.rows = np.array(rows, np.complex128)
        self.rigid_rows = self.rows[:2].copy()
        self.turn = (1j * points.offset).conj()


#: A contact wavers between a few choices of markers; this many are kept.
_KEPT = 64


class _Kept(threading.local):
    """What one thread keeps from frame to frame; another thread's frames must not get in between."""

    last: tuple[Observation, Motion, int, SlipResidual | None] | None = None
    position_m: NDArray[np.float64] | None = None
    contacts: dict[tuple[bytes, Motion], _Contact]

    def __init__(self) -> None:
        self.contacts = {}


_kept = _Kept()


def _contact(field: DeformationField, chosen: NDArray[np.bool_], motion: Motion) -> _Contact:
    """Return what belongs to the chosen markers: their rest positions, and so all of it, stay from frame to frame."""
    if _kept.position_m is not field.position_m or len(_kept.contacts) >= _KEPT:
        _kept.position_m = field.position_m
        _kept.contacts = {}
    key = (chosen.tobytes(), motion)
    contact = _kept.contacts.get(key)
    if contact is None:
        contact = _kept.contacts[key] = _Contact(field, chosen, motion)
    return contact


def confidence(score: float, threshold: float) -> float:
    """Return how far a score is from its threshold, in [0, 1]: 0 at it, 0.8 a factor of two away."""
    return 1.0 - math.pow(0.2, abs(math.log2(max(score, 1e-12) / threshold)))
