"""Motion of the imprint between frames: the slip of the object against the gel, and the motion of the gel."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.tactile.imprint.carrying import LEAST_DOTS, CarriedGel, fastest
from lsds.tactile.imprint.faint import FaintDots
from lsds.tactile.imprint.layers import Layers
from lsds.tactile.imprint.registration import Registered, Registration
from lsds.tactile.imprint.relief import ReliefMaker
from lsds.tactile.imprint.residue import DotResidue
from lsds.tactile.imprint.search import leapt
from lsds.tactile.views import viewed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import DeformationField, Frame, MarkerReference


@dataclass(frozen=True, eq=False, slots=True)
class ImprintMotion:
    """Motion of the imprint between two frames, in the sensor's plane (x right, y down, turns clockwise).

    - `slip_m` (x, y) and `turn_rad`: motion of the imprint against the gel, about `centre_m`.
    - `gel_m`: motion of the gel there; `dots_m`: minimum motion of the fastest tenth of the markers.
    - `information` (3, 3) of (x, y, turn) for white noise of unit variance, in 1/m^2, 1/m and 1. It is small along
      directions that the imprint does not determine.
    - `match`: correlation of the two reliefs as registered; `stuck_match`: their correlation without slip.
    - `seen`: share of the imprint's edges that is still in view.
    - `gain`: factor by which the imprint became stronger; `strength`: its RMS curvature; `residual`: RMS curvature of
      the difference.
    - `grown`: ratio of the RMS gradients at the edges of the two reliefs, each at its own edges.
    - `radius_m`: radius of gyration of the edges.
    - `redrawn`: whether the second image is a video codec's key frame, in which faint edges jump.
    """

    slip_m: tuple[float, float]
    turn_rad: float
    gel_m: tuple[float, float]
    dots_m: float
    centre_m: tuple[float, float]
    information: NDArray[np.float64]
    match: float
    stuck_match: float
    seen: float
    gain: float
    strength: float
    residual: float
    grown: float
    radius_m: float
    redrawn: bool = False


Start = tuple[float, float, float]
"""Start of a registration: slip x, y (relief px) and turn (rad)."""

Step = Callable[[Callable[[], ImprintMotion | None]], ImprintMotion | None]
"""Runs the computation of a frame's motion: marks it, times it, and names it in errors."""


class ImprintFollower:
    """Follows the imprint of one stream from frame to frame. Motions are computed on first use."""

    def __init__(
        self,
        metres_per_px: float,
        reference: MarkerReference,
        image: Frame,
        step: Step | None = None,
        *,
        compiled: bool = False,
    ) -> None:
        """`image` is the reference's frame, with or without contact. `step` runs the computation of the motions.

        `compiled` is whether compiled functions compute them.
        """
        self._metres_per_px = metres_per_px
        self._step = step
        self._maker = ReliefMaker(compiled=compiled)
        self._faint = FaintDots(reference, image, metres_per_px)
        relief = self._maker.relief(image, self._faint.xy_px, self._faint.radius_px)
        self._residue = DotResidue(reference, relief, metres_per_px)
        self._sharpness = sharpness(image, compiled=compiled)
        self.reset()

    def reset(self) -> None:
        """Forget the last frame."""
        self._last: Shown | None = None
        self._asked: tuple[FollowedImprint, ...] = ()

    def follow(self, frame: Frame, field: DeformationField) -> FollowedImprint:
        """Return the imprint of the next frame. Call it for its motion before the frame after that is followed."""
        now = Shown(frame, field, self._maker, self._faint, self._residue, self._metres_per_px, self._sharpness)
        before, self._last = self._last, now
        for asked in self._asked:
            asked.forget()
        followed = FollowedImprint(before, self._last, self._asked, self._step)
        self._asked = (followed, *self._asked)[: RECENT - 1]
        return followed


class FollowedImprint:
    """An `Imprint`: registers two frames on the first call and keeps the result."""

    __slots__ = ("_answer", "_earlier", "_frames", "_late", "_step", "_superseded")

    def __init__(
        self,
        before: Shown | None,
        now: Shown,
        earlier: tuple[FollowedImprint, ...] = (),
        step: Step | None = None,
    ) -> None:
        self._step = step
        self._frames: tuple[Shown, Shown] | None = None if before is None else (before, now)
        self._answer: ImprintMotion | None = None
        self._earlier = earlier
        self._superseded = self._late = False
        if earlier:
            earlier[0]._superseded = True

    def forget(self) -> None:
        """Release the earlier frames: their motions are no longer needed."""
        self._earlier = ()

    def skip(self) -> None:
        """Compute nothing: the motion counts as unknown."""
        self._frames = None

    @property
    def known(self) -> ImprintMotion | None:
        """The imprint's motion if it was computed before the next frame came; nothing is computed."""
        return None if self._late else self._answer

    def recent(self) -> list[ImprintMotion]:
        """Return the motions of this and the last frames, the newest first, up to the first unknown one."""
        motions: list[ImprintMotion] = []
        for followed in (self, *self._earlier):
            motion = followed()
            if motion is None:
                break
            motions.append(motion)
        return motions

    def __call__(self) -> ImprintMotion | None:
        """Return the imprint's motion since the last frame; None on the first frame and if it cannot be estimated."""
        if self._frames is not None:
            (before, now), self._frames = self._frames, None
            self._late = self._superseded
            compute = partial(imprint_motion, before, now, self._earlier[0] if self._earlier else None)
            self._answer = compute() if self._step is None else self._step(compute)
        return self._answer


class Shown:
    """Relief and field of one frame; the relief is computed on first use."""

    def __init__(
        self,
        frame: Frame,
        field: DeformationField,
        maker: ReliefMaker,
        faint: FaintDots,
        residue: DotResidue,
        metres_per_px: float,
        reference_sharpness: float,
    ) -> None:
        self._frame, self._maker, self._faint, self._residue = frame, maker, faint, residue
        self._reference_sharpness = reference_sharpness
        self.field, self.metres_per_px, self.redrawn = field, metres_per_px, frame.redrawn
        self.compiled = maker.compiled

    @cached_property
    def sharpness(self) -> float:
        """Sharpness of the image relative to the reference, natural logarithm."""
        own = sharpness(self._frame, compiled=self.compiled)
        return math.log(max(own, _FLAT) / max(self._reference_sharpness, _FLAT))

    @cached_property
    def layers(self) -> Layers:
        """The relief at several resolutions."""
        relief = self._maker.relief(self._frame, self._faint.carried(self.field), self._faint.radius_px)
        relief = self._residue.taken_off(relief, self.field)
        self.scale = relief.scale
        return Layers(relief, compiled=self.compiled)


def sharpness(frame: Frame, *, compiled: bool = False) -> float:
    """Return the RMS difference of neighbouring pixels relative to their mean; nearly all comes from markers' rims."""
    grey = viewed(frame).half_grey
    if compiled:
        from lsds.tactile.compiled.sharpness import squares_of

        squared, total = squares_of(grey)
        return float(math.sqrt(squared / grey.size) / max(total / grey.size, 1.0))
    across, down = cv2.norm(grey[:, 1:], grey[:, :-1], cv2.NORM_L2), cv2.norm(grey[1:], grey[:-1], cv2.NORM_L2)
    return math.hypot(across, down) / math.sqrt(grey.size) / max(cv2.mean(grey)[0], 1.0)


#: Lower bound of a sharpness whose logarithm is taken: a uniform image has none; chosen.
_FLAT = 1e-6
#: Number of frames whose motions are kept, to be added up.
RECENT = 4
#: Match on the finest layer above which no search from coarse to fine is needed. In none of 469 such pairs of recorded
#: frames did the search end more than half a relief pixel away.
GOOD = 0.9
#: Minimum share of the edges in view for such a match.
IN_VIEW = 0.8
#: Match below which the imprint may have leapt. Of 17977 recorded pairs, 228 then search for the whole imprint; with a
#: bound of 0.5, 20 of them would miss a better match.
POOR = 0.7
#: Distance between the results of the finest layer alone and of all layers above which the imprint may have leapt,
#: relief px.
APART_PX = 0.5
#: Minimum improvement of the match by another start.
BETTER = 0.01
#: Maximum difference in sharpness of two images to be registered, natural logarithm: beyond it they show different
#: details of one surface. It equals a change of defocus by 1.4 px; fewer than one in a thousand pairs of recorded
#: frames reach half of it.
REFOCUSED = 0.25
#: Loss of sharpness against the reference above which only edges of markers and lamps remain, natural logarithm.
BLURRED = 0.6
#: Minimum share of the imprint's edges in view for an estimate.
LEAST_EDGES_SHARE = 0.1
#: Maximum RMS curvature that camera noise alone has at the edges that it makes. The faintest of ten thousand frames
#: recorded in contact has 1.3 times as much.
FAINT_CURVATURE = 0.006
#: Displacement of markers below which they are at rest, px: noise moves them by as much.
REST_PX = 0.15


def imprint_motion(before: Shown, now: Shown, earlier: FollowedImprint | None = None) -> ImprintMotion | None:
    """Return the imprint's motion from `before` to `now`; `earlier` gives its motion up to `before`.

    None if there are too few markers for the gel's motion, no edges, images of different sharpness, or no contact:
    the relief is no stronger than noise and the markers are at rest.
    """
    if min(before.sharpness, now.sharpness) < -BLURRED or abs(now.sharpness - before.sharpness) > REFOCUSED:
        return None
    metres, reference = now.metres_per_px, now.field.reference
    gel = carried_gel(before.field, now.field, metres, compiled=now.compiled)
    first, second = before.layers, now.layers
    edges, px = first[0].edges, before.scale
    if gel is None or edges.total <= 0:
        return None
    centre, radius = edges.centre, edges.radius
    registration = Registration(first, second, gel, centre, px)
    rest = registration.at_rest()
    if rest is None or (rest.strength < FAINT_CURVATURE and _rests(now.field, metres)):
        return None
    here = gel.at(np.array([centre[0] * px], np.float32), np.array([centre[1] * px], np.float32))[0].tolist()
    unit = px * metres

    def starts() -> Iterator[Start]:
        last = None if earlier is None else earlier()
        if last is not None:
            # Fast slip continues, so the last step is a good guess of this one, and takes less time than the search.
            yield last.slip_m[0] / unit, last.slip_m[1] / unit, last.turn_rad
        yield leapt(first[1], second[1], centre, radius, (here[0] / px, here[1] / px))

    found = best_of(registration, rest.seen, starts())
    if found is None or found.seen < LEAST_EDGES_SHARE:
        return None
    width, height = reference.image_size
    per_metre = np.array([1 / unit, 1 / unit, 1.0])
    return ImprintMotion(
        slip_m=(found.slip[0] * unit, found.slip[1] * unit),
        turn_rad=found.slip[2],
        gel_m=(here[0] * metres, here[1] * metres),
        dots_m=gel.fastest_px * metres,
        centre_m=((centre[0] * px - (width - 1) / 2) * metres, (centre[1] * px - (height - 1) / 2) * metres),
        information=found.information * (per_metre[:, None] * per_metre),
        match=found.match,
        stuck_match=rest.match,
        seen=found.seen,
        gain=found.gain,
        strength=found.strength,
        residual=found.residual,
        grown=second[0].edges.steepness / max(edges.steepness, 1e-12),
        radius_m=radius * unit,
        redrawn=now.redrawn,
    )


def best_of(registration: Registration, seen: float, starts: Iterable[Start]) -> Registered | None:
    """Return the registration with the best match; tries further starts only while the match is poor.

    `seen` is the share of the edges in view without slip.
    """
    found = registration.slipped(layers=1)
    if found is None or (found.match > GOOD and found.seen > IN_VIEW * seen):
        return found
    searched = registration.slipped()
    apart = searched is not None and math.dist(searched.slip[:2], found.slip[:2]) > APART_PX
    if searched is not None and searched.match > found.match:
        found = searched
    for start in starts:
        if found.match > POOR and not apart:
            break
        other = registration.slipped(start, layers=2)
        if other is not None and other.match > found.match + BETTER:
            found, apart = other, False
    return found


def _rests(field: DeformationField, metres_per_px: float) -> bool:
    """Return whether nine tenths of the markers are at rest."""
    return fastest(field.displacement_m[field.valid]) < REST_PX * metres_per_px


def carried_gel(
    before: DeformationField, now: DeformationField, metres_per_px: float, *, compiled: bool = False
) -> CarriedGel | None:
    """Return the gel's motion between two fields of one reference; None if they share too few markers."""
    position, moved = moved_dots(before, now, metres_per_px)
    if len(position) < LEAST_DOTS:
        return None
    reference = now.reference
    return CarriedGel(position, moved, sum(reference.pitch_px) / 2, reference.image_size, compiled=compiled)


def moved_dots(
    before: DeformationField, now: DeformationField, metres_per_px: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return position in the first field and motion of the markers valid in both fields, (n, 2) each in px."""
    both = before.valid & now.valid
    shown = before.displacement_m[both]
    position = now.reference.xy_px[both] + shown / metres_per_px
    return position, (now.displacement_m[both] - shown) / metres_per_px
