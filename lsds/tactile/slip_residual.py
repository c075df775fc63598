"""Residual that slip leaves in the velocity field, separated from sticking, pressing and jitter.

A gel that a sticking object carries along moves smoothly: as a rigid body, evenly sheared and stretched, or gently
bent. A sliding surface releases the markers one by one, so each deviates from the best smooth motion, in the direction
of the shear that friction holds. Pressing harder and the tracker's jitter also leave a residual, but equally in all
directions. Slip is therefore the residual along the shear less the residual across it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from lsds.tactile.plane_motion import Points, as_complex, smooth_basis

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import ContactPatch, DeformationField, MarkerReference, Observation

Motion = Literal["rigid", "affine", "quadratic"]


class SlipResidual(NamedTuple):
    """One frame's evidence of slip, in SI units.

    `along` and `across` the shear are mean squares (m/s)^2 of the residual velocity. `translation` and `rim`, both
    (m/s)^2, are the squared parts of the best rigid motion of the velocities; `rim` is rotation at the radius of
    gyration `radius_m`. `shear_m` (x, y) and `twist_rad` are the rigid motion of the displacements, which friction
    holds. `markers` is the number of markers used.
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
        """Mean square (m/s)^2 of the residual along the shear less that across it, at least zero."""
        return max(0.0, self.along - self.across)


def slip_residual(observation: Observation, motion: Motion = "quadratic", least: int = 6) -> SlipResidual | None:
    """Return the frame's evidence from the markers in contact; None with fewer than `least` of them or no velocity.

    Observations from perception carry their evidence; for others it is computed here.
    """
    evidence = observation.evidence
    if evidence is None:
        evidence = SlipEvidence(observation.field, observation.contact, EvidenceBasis(observation.field.reference))
    return evidence(motion, least)


class SlipEvidence:
    """The evidence of one frame: `evidence(motion, least)` computes each result once."""

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


#: Number of marker selections kept: a contact alternates between a few.
_SELECTIONS_KEPT = 64


class EvidenceBasis:
    """Terms of one reference that all frames share: the markers' rest positions and the linear operators on them."""

    def __init__(self, reference: MarkerReference) -> None:
        self.markers = ContactMarkers(reference)
        self._contacts: dict[tuple[bytes, Motion], _Contact] = {}

    def contact(self, field: DeformationField, chosen: NDArray[np.bool_], motion: Motion) -> _Contact:
        """Return the terms of the chosen markers (N,)."""
        key = (chosen.tobytes(), motion)
        contact = self._contacts.get(key)
        if contact is None:
            if len(self._contacts) >= _SELECTIONS_KEPT:
                self._contacts.clear()
            contact = self._contacts[key] = _Contact(field, chosen, motion)
        return contact


def _residual(
    field: DeformationField, patch: ContactPatch | None, basis: EvidenceBasis, motion: Motion, least: int
) -> SlipResidual | None:
    chosen = basis.markers.in_contact(field.valid, patch, least)
    velocity = as_complex(field.velocity_m_s)
    # One product tests all markers. A marker that was lost in the last frame is valid but has no velocity.
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
    # Direction of the shear at each marker: translation and twist of the displacements, without the spread by pressing.
    # It is conjugate, so that the product's real part is the residual along it.
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
    """One selection of a reference's markers with its linear operators, computed once for many frames.

    `rows` (2 + terms, n) give translation, rotation (the imaginary part) and the coordinates in the smooth basis;
    `rigid_rows` are the first two of them. `minus_basis` (n, terms) is the negative smooth basis. `turn` (n,) is the
    conjugate of a unit rotation's motion. `square` converts a sum of squared residuals to their mean square.
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
    """Return a score's distance from its threshold, in [0, 1]: 0 at the threshold, 0.8 at half or twice it."""
    return 1.0 - math.pow(0.2, abs(math.log2(max(score, 1e-12) / threshold)))


class ContactMarkers:
    """The markers of one reference, and the depth pixel that each rests on."""

    def __init__(self, reference: MarkerReference) -> None:
        self._reference = reference
        self._shape: tuple[int, ...] = ()
        self._pixels: NDArray[np.intp] = np.empty(0, np.intp)

    def in_contact(self, valid: NDArray[np.bool_], contact: ContactPatch | None, least: int) -> NDArray[np.bool_]:
        """Return the mask (N,) of the valid markers at which the gel is pressed beyond the contact threshold.

        If there are fewer than `least`, the contact is too small or too shallow to detect: returns all valid markers.
        """
        if contact is None:
            return valid
        if contact.depth_m.shape != self._shape:
            self._shape = contact.depth_m.shape
            self._pixels = self._at(*contact.depth_m.shape)
        touched = valid & (contact.depth_m.take(self._pixels) > contact.threshold_m)
        return touched if np.count_nonzero(touched) >= least else valid

    def _at(self, rows: int, columns: int) -> NDArray[np.intp]:
        """Return the flat index of each marker's pixel in a depth map."""
        width, height = self._reference.image_size
        column = np.minimum((self._reference.xy_px[:, 0] * (columns / width)).astype(np.intp), columns - 1)
        row = np.minimum((self._reference.xy_px[:, 1] * (rows / height)).astype(np.intp), rows - 1)
        return np.asarray(row * columns + column)
