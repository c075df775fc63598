"""Follows the dots of a gel from frame to frame: predict, refine, verify; match the whole grid when in doubt.

The fast path extrapolates the motion. Every marker is refined from its predicted position and must land on a dark
pixel, close to the prediction, without the grid tearing or folding. If more than a stray marker fails, the dots of the
whole image are found and matched again (`association`). Uncertain markers are flagged, never guessed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds.contracts import MarkerReference, MarkerTracks, TrackFlag
from lsds.tactile.views import HALF, ViewedFrame, viewed
from lsds_plugins.trackers.dotted.association import associate
from lsds_plugins.trackers.dotted.find_dots import find_dots
from lsds_plugins.trackers.dotted.lattice import Lattice
from lsds_plugins.trackers.dotted.pad import find_reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Frame
    from lsds_plugins.trackers.dotted.localise import Localiser

#: Distance of a refined position from its prediction, in pitches, above which the whole grid has to confirm it.
SURPRISE = 0.2
#: Distance of a refined position from its starting dot, in pitches, above which it has slid off the dot.
SLID_OFF = 0.12
#: Area of a grid cell relative to the reference beyond which a corner of it must be wrong.
AREA_RATIO = (0.35, 2.2)
#: Longest gap (s) over which motion is extrapolated.
LONGEST_GAP_S = 0.25
#: Longest extrapolation of motion, in pitches.
EXTRAPOLATED_PITCHES = 0.75
#: Frames after which a grid with several missing markers is matched as a whole again.
RECHECK = 12
#: A marker whose displacement differs this much, in pitches, from the median around it is on another marker's dot.
APART_PITCHES = 0.7
#: Displacement of the whole gel, in pitches, that cannot be reached in one leap.
FAR = 0.75
#: Largest displacement of a marker, in pitches: 3.5 mm, which is most of the gel's thickness.
FARTHEST = 1.75
#: Number of failing markers above which the whole grid is matched; fewer are single dots, worn off or hidden.
STRAY = 2
#: Grey level, of 255, below which gel and dot cannot be distinguished; chosen.
BLACK_LEVEL = 8
#: Grey level, of 255, above which gel and dot cannot be distinguished; chosen.
SATURATED_LEVEL = 247
_OK, _LOST = TrackFlag.OK.value, TrackFlag.LOST.value
_OUT, _INCONSISTENT, _AMBIGUOUS = (
    TrackFlag.OUT_OF_VIEW.value,
    TrackFlag.INCONSISTENT.value,
    TrackFlag.AMBIGUOUS.value,
)


class DotFollower:
    """State of a dot tracker: the reference, the last positions and their velocities."""

    def __init__(self, localiser: Localiser) -> None:
        self._localiser = localiser
        self._reference: MarkerReference | None = None

    def start(self, frame: Frame, pad: tuple[int, int] | None = None) -> MarkerReference:
        """Take the undeformed frame as reference. The printed `pad` (rows, columns), if known, resolves more cases.

        Raises DataError if the frame shows no grid of dots.
        """
        views = viewed(frame)
        found = find_reference(views, pad)
        reference, diameter = found.reference, found.diameter_px
        xy = self._localiser.start(views.grey, reference.xy_px, diameter)
        self._reference = MarkerReference(
            xy, reference.cell, reference.shape, reference.pitch_px, reference.axes, reference.image_size
        )
        self._lattice = Lattice(self._reference, found.complete)
        self._edge_px = self._localiser.visible * diameter
        self._reference_area = self._areas(xy)
        self._xy_home = xy
        self._apart_px = APART_PITCHES * self._lattice.pitch_px
        self.reset()
        return self._reference

    def reset(self) -> None:
        """Clear the motion: the dots are expected at their places in the reference, at rest."""
        reference = self._started()
        self._xy = reference.xy_px.copy()
        self._velocity = np.zeros_like(self._xy)
        self._trusted = self._xy
        self._failed = np.zeros(reference.count, bool)
        self._doubt = False
        self._unchecked = 0
        self._t_ns: int | None = None

    def update(self, frame: Frame) -> MarkerTracks:
        """Follow the dots into `frame`."""
        self._started()
        views = viewed(frame)
        dt = 0.0 if self._t_ns is None else max(0.0, (frame.t_ns - self._t_ns) * 1e-9)
        predicted = self._predict(dt)
        mask = views.dark
        xy = self._localiser.refine(views.grey, predicted)
        flags = self._verify(xy, predicted, mask, SURPRISE)
        failed = flags != _OK
        settled = xy
        if self._doubt or failed.any():
            if self._needs_grid(failed):
                xy, predicted, flags = self._ask_grid(views, predicted, mask)
                failed = flags != _OK
                self._doubt = bool(np.count_nonzero(failed) > 0.5 * len(failed))
            else:
                # Stray losses: expect them to have moved as their neighbours.
                predicted = self._carry(predicted, xy - predicted, failed)
            flags[(flags == _OK) & (np.abs(xy - self._xy_home).max(axis=1) > FARTHEST * self._lattice.pitch_px)] = (
                _INCONSISTENT
            )
            failed = flags != _OK
            stray = self._lattice.stray(np.where(failed[:, None], 0.0, xy - self._xy_home), ~failed, self._apart_px)
            if stray.any():
                flags[stray] = _INCONSISTENT
                failed = flags != _OK
            if self._leapt(xy, failed):
                flags[~failed] = _AMBIGUOUS
                failed, self._doubt = np.ones_like(failed), True
                predicted = self._xy
            settled = np.where(failed[:, None], predicted, xy)
            flags[failed & (flags != _AMBIGUOUS) & ~self._lattice.in_view(settled, self._edge_px)] = _OUT
            xy = settled.copy()
            xy[failed] = np.nan
        self._remember(settled, failed, dt)
        self._t_ns = frame.t_ns
        return MarkerTracks(frame.t_ns, frame.seq, xy, ~failed, flags.astype(np.uint8))

    def _leapt(self, xy: NDArray[np.float64], failed: NDArray[np.bool_]) -> bool:
        """Return whether the whole gel is far from rest, after a leap, on a pad that extends beyond the image.

        On such a pad no row or column goes missing, so the leap may as well be wrong by a pitch.
        """
        if self._lattice.complete or failed.all():
            return False
        seen = ~failed
        home = np.abs(np.median((xy - self._xy_home)[seen], axis=0)).max()
        leap = np.abs(np.median((xy - self._trusted)[seen], axis=0)).max()
        return bool(home > FAR * self._lattice.pitch_px and leap > 0.5 * self._lattice.pitch_px)

    def _needs_grid(self, failed: NDArray[np.bool_]) -> bool:
        """Return whether the grid has to be matched as a whole, because more than single dots have failed."""
        self._unchecked = self._unchecked + 1 if np.count_nonzero(failed) > STRAY else 0
        if self._doubt or self._unchecked > RECHECK or np.count_nonzero(failed & ~self._failed) > STRAY:
            self._unchecked = 0
            return True
        return False

    def _remember(self, settled: NDArray[np.float64], failed: NDArray[np.bool_], dt: float) -> None:
        """Keep positions and velocities for the next prediction."""
        if dt > 0:
            velocity = (settled - self._xy) * (1 / dt)
            unsure = failed | self._failed
            if unsure.any():
                velocity[unsure] = np.median(velocity, axis=0)
            self._velocity = velocity
        if self._doubt:
            self._velocity = np.zeros_like(settled)
        else:
            self._trusted = settled
        self._xy, self._failed = settled, failed

    def _predict(self, dt: float) -> NDArray[np.float64]:
        """Extrapolate, but not over a gap in the stream and not as far as the place of another dot."""
        if dt > LONGEST_GAP_S:
            return self._xy.copy()
        step = self._velocity * dt
        furthest = EXTRAPOLATED_PITCHES * self._lattice.pitch_px
        if np.abs(step).max() > furthest:
            step = np.clip(step, -furthest, furthest)
        return np.asarray(self._xy + step)

    def _started(self) -> MarkerReference:
        if self._reference is None:
            raise RuntimeError("start() has to see the undeformed frame before update() or reset()")
        return self._reference

    def _ask_grid(
        self, views: ViewedFrame, predicted: NDArray[np.float64], mask: NDArray[np.uint8]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.intp]]:
        """Find all dots, match them with the markers, and refine the positions."""
        grey = views.half_grey
        hidden = (grey <= BLACK_LEVEL) | (grey >= SATURATED_LEVEL)
        match = associate(predicted, find_dots(mask).xy_px, self._lattice, self._trusted, hidden)
        xy = self._localiser.refine(views.grey, match.expected_px)
        flags = self._verify(xy, match.expected_px, mask, SLID_OFF)
        flags[(match.dot < 0) & (flags == _OK)] = _LOST
        flags[(flags == _OK) & ~match.sure] = _AMBIGUOUS
        # A doubtful position must not be the next frame's expectation, or it would confirm itself.
        expected = np.where(match.sure[:, None], match.expected_px, predicted)
        return xy, expected, flags

    def _verify(
        self, xy: NDArray[np.float64], expected: NDArray[np.float64], mask: NDArray[np.uint8], reach: float
    ) -> NDArray[np.intp]:
        """Flag markers that are not on a dark spot, strayed more than `reach` pitches, or tear the grid."""
        lattice = self._lattice
        flags = np.full(len(xy), _LOST)
        seen = lattice.in_view(xy, self._edge_px)
        inside = xy if seen.all() else np.where(seen[:, None], xy, 0.0)
        pixel = (inside * (1 / HALF)).astype(np.intp)
        flags[seen & (mask[pixel[:, 1], pixel[:, 0]] > 0)] = _OK
        offset = np.abs(inside - expected)
        if offset.max() > reach * lattice.pitch_px:
            strayed = np.maximum(offset[:, 0], offset[:, 1]) > reach * lattice.pitch_px
            flags[(flags == _OK) & strayed] = _INCONSISTENT
        ratio = self._areas(inside) / self._reference_area
        if ratio.min() < AREA_RATIO[0] or ratio.max() > AREA_RATIO[1]:
            corner, right, below = lattice.corner, lattice.corner_right, lattice.corner_below
            ok = flags == _OK
            torn = ((ratio < AREA_RATIO[0]) | (ratio > AREA_RATIO[1])) & ok[corner] & ok[right] & ok[below]
            if torn.any():
                suspects = np.concatenate([corner[torn], right[torn], below[torn]])
                # Every marker is in up to three triangles; the marker that torn ones share is wrong.
                votes = np.bincount(suspects, minlength=len(xy))
                flags[(votes >= 2) | ((votes > 0) & (votes == votes.max()))] = _INCONSISTENT
        return flags

    def _areas(self, xy: NDArray[np.float64]) -> NDArray[np.float64]:
        """Signed areas of the triangles (corner, right, below) of the grid's cells, px^2 times two."""
        lattice = self._lattice
        point = np.ascontiguousarray(xy).view(np.complex128)[:, 0]
        corner = point[lattice.corner]
        return np.asarray(((point[lattice.corner_right] - corner).conj() * (point[lattice.corner_below] - corner)).imag)

    def _carry(
        self, predicted: NDArray[np.float64], moved: NDArray[np.float64], failed: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Shift the prediction of failed markers by the mean surprise of their good neighbours."""
        lattice = self._lattice
        lost = np.flatnonzero(failed)
        neighbour = np.minimum(lattice.neighbour[lost], lattice.count - 1)
        good = lattice.has_neighbour[lost] & (lattice.neighbour[lost] < lattice.count) & ~failed[neighbour]
        many = np.maximum(good.sum(axis=1), 1)[:, None]
        shifted = predicted.copy()
        shifted[lost] += np.where(good[..., None], moved[neighbour], 0.0).sum(axis=1) / many
        # The own past of a marker that was lost for longer misleads: a wrong position would never be corrected.
        away = (predicted + moved - self._xy_home)[neighbour]
        beside = self._xy_home[lost] + np.where(good[..., None], away, 0.0).sum(axis=1) / many
        stale = self._failed[lost] & good.any(axis=1)
        shifted[lost[stale]] = beside[stale]
        return shifted
