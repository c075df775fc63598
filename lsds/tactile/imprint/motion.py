"""The imprint's motion from frame to frame: how far the object has slipped against the gel, and the gel itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple

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


class ImprintMotion(NamedTuple):
    """Motion of the imprint between two frames, in the sensor's plane (x right, y down, turns clockwise).

    `slip_m` (x, y) and `turn_rad` are the imprint's motion against the gel, about `centre_m`; `gel_m` is the gel's own
    motion there, and `dots_m` how far the fastest tenth of the dots has moved. `information` (3, 3), in 1/m^2, 1/m and
    1, is that of (x, y, turn) for white noise of unit variance: small along what the imprint does not tell. `match` is
    the correlation of the two reliefs as registered,
    `stuck_match` the one if nothing had slipped. `seen` is the share of the imprint's edges that is still in view,
    `gain` the factor by which it became stronger, `strength` its RMS curvature, `residual` that of what is left,
    `grown` the ratio of the two reliefs' edges, wherever they are, RMS; `radius_m` the edges' radius of gyration;
    `redrawn` whether a video codec has drawn the second image anew, so that faint edges jump.
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
"""Where a registration starts: slip x, y (relief px) and turn (rad)."""

Step = Callable[[Callable[[], ImprintMotion | None]], ImprintMotion | None]
"""Makes the computation of a frame's motion: marks it, times it, and names it in errors."""


class ImprintFollower:
    """Follows the imprint of one stream from frame to frame. Nothing is computed before somebody asks."""

    def __init__(
        self, metres_per_px: float, reference: MarkerReference, image: Frame, step: Step | None = None
    ) -> None:
        """`image` is the reference's frame; whether something touches it does not matter. `step` makes the computation
        of a frame's motion, when it is asked for."""
        self._metres_per_px = metres_per_px
        self._step = step
        self._maker = ReliefMaker()
        self._faint = FaintDots(reference, image, metres_per_px)
        relief = self._maker.relief(image, self._faint.xy_px, self._faint.radius_px)
        self._residue = DotResidue(reference, relief, metres_per_px)
        self._sharpness = sharpness(image)
        self.reset()

    def reset(self) -> None:
        """Forget the last frame."""
        self._last: Shown | None = None
        self._asked: tuple[FollowedImprint, ...] = ()

    def follow(self, frame: Frame, field: DeformationField) -> FollowedImprint:
        """Return the imprint of the next frame, to be asked for its motion before the one after it."""
        now = Shown(frame, field, self._maker, self._faint, self._residue, self._metres_per_px, self._sharpness)
        before, self._last = self._last, now
        for asked in self._asked:
            asked.forget()
        followed = FollowedImprint(before, self._last, self._asked, self._step)
        self._asked = (followed, *self._asked)[: RECENT - 1]
        return followed


class FollowedImprint:
    """An `Imprint`: registers two frames when it is first asked, and remembers the answer."""

    __slots__ = ("_answer", "_earlier", "_frames", "_step")

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

    def forget(self) -> None:
        """Let go of the frames before: they are asked for no more."""
        self._earlier = ()

    def recent(self) -> list[ImprintMotion]:
        """Return the motions of this and the last frames, the newest first, up to where one is not known."""
        motions: list[ImprintMotion] = []
        for followed in (self, *self._earlier):
            motion = followed()
            if motion is None:
                break
            motions.append(motion)
        return motions

    def __call__(self) -> ImprintMotion | None:
        """Return the imprint's motion since the frame before; None on the first frame and where it cannot be told."""
        if self._frames is not None:
            (before, now), self._frames = self._frames, None
            compute = partial(imprint_motion, before, now, self._earlier[0] if self._earlier else None)
            self._answer = compute() if self._step is None else self._step(compute)
        return self._answer


class Shown:
    """What one frame shows of object and gel; the relief is made when it is first asked for."""

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

    @cached_property
    def sharpness(self) -> float:
        """How sharp the image is relative to the reference, natural logarithm."""
        return math.log(max(sharpness(self._frame), _FLAT) / max(self._reference_sharpness, _FLAT))

    @cached_property
    def layers(self) -> Layers:
        """The relief at several resolutions."""
        relief = self._maker.relief(self._frame, self._faint.carried(self.field), self._faint.radius_px)
        relief = self._residue.taken_off(relief, self.field)
        self.scale = relief.scale
        return Layers(relief)


def sharpness(frame: Frame) -> float:
    """Return the RMS difference of neighbouring pixels relative to their mean, nearly all of it from the dots' rims."""
    grey = viewed(frame).half_grey
    across, down = cv2.norm(grey[:, 1:], grey[:, :-1], cv2.NORM_L2), cv2.norm(grey[1:], grey[:-1], cv2.NORM_L2)
    return math.hypot(across, down) / math.sqrt(grey.size) / max(cv2.mean(grey)[0], 1.0)


_FLAT = 1e-6
#: Frames whose motions are remembered, to be added up.
RECENT = 4
#: A match this good on the finest layer, with this share of its edges still in view, needs no search from coarse to
#: fine: in none of 469 such pairs of recorded frames did the search end more than half a relief pixel away.
GOOD, IN_VIEW = 0.9, 0.8
#: The imprint may have leapt if the match is worse than this, or if the finest layer alone and the search from coarse
#: to fine end further apart than this, relief px. In 17977 recorded pairs, 228 look for the whole imprint; with a
#: bound of 0.5, 20 of them would miss a place that matches better.
POOR, APART_PX = 0.7, 0.5
#: Another start has to match better by this.
BETTER = 0.01
#: Two images that differ more in sharpness, natural logarithm, show different things of one surface. A change of
#: defocus by 1.4 px comes to as much; of a thousand pairs of recorded frames less than one does to half of it.
REFOCUSED = 0.25
#: An image that much less sharp than the reference, natural logarithm, shows edges of dots and lamps alone.
BLURRED = 0.6
#: Less of the imprint's edges in view than this tells nothing of the rest.
LEAST_SEEN = 0.1
#: Camera noise alone has up to this curvature (RMS at the edges it makes); the faintest of ten thousand frames recorded
#: in contact has 1.3 times as much.
FAINT = 0.006
#: Dots that are displaced by less than this, px, are at rest: noise moves them by as much.
REST_PX = 0.15


def imprint_motion(before: Shown, now: Shown, earlier: FollowedImprint | None = None) -> ImprintMotion | None:
    """Return how the imprint has moved from `before` to `now`; `earlier` knows its motion up to `before`.

    None where too few dots tell how the gel did, there are no edges, the images are not of the same sharpness, or
    nothing touches the gel: neither is there more relief than noise has, nor is a dot away from rest.
    """
    if min(before.sharpness, now.sharpness) < -BLURRED or abs(now.sharpness - before.sharpness) > REFOCUSED:
        return None
    metres, reference = now.metres_per_px, now.field.reference
    gel = carried_gel(before.field, now.field, metres)
    first, second = before.layers, now.layers
    edges, px = first[0].edges, before.scale
    told = edges.squared
    total = float(told.sum())
    if gel is None or total <= 0:
        return None
    centre = (float(told @ edges.x) / total, float(told @ edges.y) / total)
    registration = Registration(first, second, gel, centre, px)
    rest = registration.at_rest()
    if rest is None or (rest.strength < FAINT and _rests(now.field, metres)):
        return None
    here = gel.at(np.array([centre[0] * px], np.float32), np.array([centre[1] * px], np.float32))[0].tolist()
    radius = math.sqrt(float(told @ ((edges.x - centre[0]) ** 2 + (edges.y - centre[1]) ** 2)) / total)
    unit = px * metres

    def starts() -> Iterator[Start]:
        last = None if earlier is None else earlier()
        if last is not None:
            # A fast slide continues, so the last step is a good guess of this one, and costs less than the search.
            yield last.slip_m[0] / unit, last.slip_m[1] / unit, last.turn_rad
        yield leapt(first[1], second[1], centre, radius, (here[0] / px, here[1] / px))

    found = best_of(registration, rest.seen, starts())
    if found is None or found.seen < LEAST_SEEN:
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
        grown=second[0].edges.steepness / max(first[0].edges.steepness, 1e-12),
        radius_m=radius * unit,
        redrawn=now.redrawn,
    )


def best_of(registration: Registration, seen: float, starts: Iterable[Start]) -> Registered | None:
    """Return the registration with the best match, with no more work than the match of each attempt calls for.

    `seen` is the share of the edges that would be in view if nothing had slipped.
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
    """Tell whether nine tenths of the dots are where the reference has them."""
    return fastest(field.displacement_m[field.valid]) < REST_PX * metres_per_px


def carried_gel(before: DeformationField, now: DeformationField, metres_per_px: float) -> CarriedGel | None:
    """Return how the gel has moved between two fields of one reference; None where they share too few dots."""
    position, moved = moved_dots(before, now, metres_per_px)
    if len(position) < LEAST_DOTS:
        return None
    reference = now.reference
    return CarriedGel(position, moved, sum(reference.pitch_px) / 2, reference.image_size)


def moved_dots(
    before: DeformationField, now: DeformationField, metres_per_px: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where the dots that both fields show were in the first, and how far they have moved, (n, 2) each in px."""
    both = before.valid & now.valid
    shown = before.displacement_m[both]
    position = now.reference.xy_px[both] + shown / metres_per_px
    return position, (now.displacement_m[both] - shown) / metres_per_px
