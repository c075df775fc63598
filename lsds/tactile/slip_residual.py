"""What slip leaves in the velocity field, told apart from sticking, pressing and jitter.

A gel carried along by a sticking object moves smoothly: as a rigid body, or sheared and stretched evenly, or with a
gentle bend. A sliding surface lets go of the markers one by one, so each deviates from the best smooth motion; and it
does so along the shear that friction holds up. Pressing harder also bends the field, but in all directions alike, and
so does the tracker's jitter. The part of the residual along the shear, less the part across it, is what slip adds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from lsds.tactile.contact_markers import ContactMarkers
from lsds.tactile.plane_motion import Points, as_complex, smooth_basis

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import ContactPatch, DeformationField, MarkerReference, Observation

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

    An observation that perception made carries its evidence; for one made by hand it is worked out here.
    """
    evidence = observation.evidence
    if evidence is None:
        evidence = SlipEvidence(observation.field, observation.contact, EvidenceBasis(observation.field.reference))
    return evidence(motion, least)


class SlipEvidence:
    """The evidence of one frame, each question answered once: `evidence(motion, least)`."""

    __slots__ = ("_answers", "_basis", "_contact", "_field")

    def __init__(self, field: DeformationField, contact: ContactPatch | None, basis: EvidenceBasis) -> None:
        self._field = field
        self._contact = contact
        self._basis = basis
        self._answers: dict[tuple[Motion, int], SlipResidual | None] = {}

    def __call__(self, motion: Motion = "quadratic", least: int = 6) -> SlipResidual | None:
        """Return the residual of the best smooth motion; None with fewer than `least` markers or no velocity."""
        key = (motion, least)
        if key not in self._answers:
            self._answers[key] = _residual(self._field, self._contact, self._basis, motion, least)
        return self._answers[key]


#: A contact wavers between a few choices of markers; this many are kept.
_KEPT = 64


class EvidenceBasis:
    """What stays from frame to frame of one reference: where the markers rest, and what is linear in their vectors."""

    def __init__(self, reference: MarkerReference) -> None:
        self.markers = ContactMarkers(reference)
        self._contacts: dict[tuple[bytes, Motion], _Contact] = {}

    def contact(self, field: DeformationField, chosen: NDArray[np.bool_], motion: Motion) -> _Contact:
        """Return what belongs to the chosen markers (N,)."""
        key = (chosen.tobytes(), motion)
        contact = self._contacts.get(key)
        if contact is None:
            if len(self._contacts) >= _KEPT:
                self._contacts.clear()
            contact = self._contacts[key] = _Contact(field, chosen, motion)
        return contact


def _residual(
    field: DeformationField, patch: ContactPatch | None, basis: EvidenceBasis, motion: Motion, least: int
) -> SlipResidual | None:
    chosen = basis.markers.in_contact(field.valid, patch, least)
    velocity = as_complex(field.velocity_m_s)
    # One product in place of a question each. A dot that was lost in the frame before has no velocity, but is valid.
    if math.isnan(np.vdot(velocity, velocity).real):
        chosen = chosen & ~np.isnan(velocity)
    contact = basis.contact(field, chosen, motion)
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
        rows = list(points.rigid_rows())
        self.minus_basis = None
        if motion != "rigid":
            basis, scale = smooth_basis(points.offset, motion)
            self.minus_basis = -basis.astype(np.complex128)
            self.square *= scale**2
            rows += list(basis.T)
        self.rows = np.array(rows, np.complex128)
        self.rigid_rows = self.rows[:2].copy()
        self.turn = (1j * points.offset).conj()


def confidence(score: float, threshold: float) -> float:
    """Return how far a score is from its threshold, in [0, 1]: 0 at it, 0.8 a factor of two away."""
    return 1.0 - math.pow(0.2, abs(math.log2(max(score, 1e-12) / threshold)))
