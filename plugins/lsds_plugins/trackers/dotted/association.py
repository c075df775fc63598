"""Matches the dots of a frame with those of the reference if prediction alone is ambiguous.

Dots repeat every pitch, so a wrong match one pitch away looks perfect to optical flow, forward-backward checks
included. Two facts resolve this: a gel does not tear, so neighbours move nearly alike; and a pad has an edge, so under
a wrong shift a whole row or column is missing in view. Labels are grown over the grid from the best-predicted marker,
then every shift by one pitch competes. If the runner-up is close, only anchored markers are accepted: those at their
place of rest or at their last certain place, and those connected to them over neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lsds.tactile.views import HALF

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lsds_plugins.trackers.dotted.lattice import Lattice

#: How far, in pitches, a dot may lie from where its labelled neighbours expect it.
GROW_GATE = 0.35
#: The gel moves as a whole if no marker's motion differs from the median by this much, in pitches.
ALIKE = 0.25
#: Cost of a marker that should be in view and is not, or of a dot without a marker.
MISS_WEIGHT = 1.5
#: Cost of the squared sudden motion (in pitches): a lost column of seven outweighs a jump of a whole pitch.
MOTION_WEIGHT = 8.0
#: A hypothesis is accepted if it beats every other by this cost.
COST_MARGIN = 3.0
#: It is doubtful if another one explains this many more dots.
EVIDENCE = 4
#: Below this cost (a quarter pitch of motion, nothing against it) no shift by a pitch can compete.
CALM = MOTION_WEIGHT * 0.25**2
#: The gel is at rest if all dots lie within this many pitches of the reference.
HOME = 0.15
#: Share of dots in place that suffices when the gel was away from rest.
HOME_SHARE = 0.8
#: Share of all markers that must be anchored before a doubtful match is accepted.
ANCHORED = 0.3
#: Share of markers that must lie between the places of rest: a leap by a whole pitch leaves none there.
BETWEEN = 0.1
#: Number of dots that a gel at rest may lack (worn off, hidden). A shift by a pitch hides a whole line.
LACKING_DOTS = 2
#: Distance from the border, px, below which a marker counts as out of view; chosen.
_BORDER_EDGE_PX = 1.0
#: The one hypothesis of a calm gel: no shift along rows and columns.
_STAY = [(0, 0)]
_SHIFTS = [(row, column) for row in (-1, 0, 1) for column in (-1, 0, 1) if row or column]


@dataclass(frozen=True, slots=True, eq=False)
class Association:
    """Result of matching.

    `dot` (N,) index of each marker's dot, -1 for none; `expected_px` (N, 2) the place of each marker, measured or
    expected; `ambiguous` true if a shift by a pitch explains the image about as well; `sure` (N,) the markers that are
    accepted nevertheless, or all of them if the match is not ambiguous.
    """

    dot: NDArray[np.intp]
    expected_px: NDArray[np.float64]
    ambiguous: bool
    sure: NDArray[np.bool_]


def associate(
    predicted_px: NDArray[np.float64],
    dots_px: NDArray[np.float64],
    lattice: Lattice,
    trusted_px: NDArray[np.float64],
    hidden: NDArray[np.bool_] | None = None,
) -> Association:
    """Match predicted markers (N, 2) with dots (M, 2) found in the frame.

    `trusted_px` (N, 2) is the last certain place of each marker. The gel may have stopped anywhere between there and
    the prediction, so only motion off that path counts against a hypothesis. `hidden` (half-size image) marks pixels
    where no dot can be visible: saturated or black ones.
    """
    count = len(predicted_px)
    if not len(dots_px):
        return Association(np.full(count, -1), predicted_px, True, np.zeros(count, bool))
    home = _at_home(dots_px, trusted_px, lattice)
    if home is not None:
        return home
    extended = lattice.extend(predicted_px)
    seen = _Seen(_labelled(extended, dots_px, lattice, trusted_px), extended, dots_px, lattice, trusted_px, hidden)
    calm = _hypotheses(_STAY, seen)
    if calm and calm[0].against == 0 and calm[0].cost < CALM:
        return Association(calm[0].dot, calm[0].expected_px, False, np.ones(count, bool))
    rivals = sorted([*calm, *_hypotheses(_SHIFTS, seen)], key=lambda c: c.cost)
    if not rivals:
        return Association(np.full(count, -1), predicted_px, True, np.zeros(count, bool))
    best = rivals.pop(0)
    if not any(rival.cost < best.cost + COST_MARGIN or _explains(rival, best) for rival in rivals):
        return Association(best.dot, best.expected_px, False, np.ones(count, bool))
    return Association(best.dot, best.expected_px, True, _anchored(best, seen))


def _anchored(best: _Hypothesis, seen: _Seen) -> NDArray[np.bool_]:
    """Return which markers (N,) are anchored under the best hypothesis: none if it cannot be accepted.

    A gel that has moved by exactly one pitch, as a whole or in part, also shows all its dots at places of rest. If some
    dots are in place and others lie between the places, the gel is deformed, and the first are anchors.
    """
    lattice = seen.lattice
    found = best.dot >= 0
    at = seen.dots[best.dot]
    reach = HOME * lattice.pitch_px
    away = at - lattice.home_px
    anchors = found & (_within(away, reach) | _within(at - seen.trusted, reach))
    # Displacement modulo the pitch: zero after a leap by a pitch, of all dots or of some.
    left = away - lattice.pitch_px * np.round(away / lattice.pitch_px)
    held, between = np.count_nonzero(anchors), np.count_nonzero(found & ~anchors & ~_within(left, reach))
    if held < ANCHORED * lattice.count or between < BETWEEN * lattice.count:
        return np.zeros(lattice.count, bool)
    return lattice.connected(anchors, found)


def _within(offset: NDArray[np.float64], reach: float) -> NDArray[np.bool_]:
    return np.asarray(np.abs(offset).max(axis=1) < reach)


def _explains(rival: _Hypothesis, best: _Hypothesis) -> bool:
    """Return whether a rival explains almost all dots while the best leaves a whole line unexplained.

    A torn or dazzled stretch of gel leaves something unexplained under every shift; a jump by a pitch does not.
    """
    return rival.against <= best.against - EVIDENCE and rival.against <= max(1, best.against // 5)


def _at_home(dots: NDArray[np.float64], trusted: NDArray[np.float64], lattice: Lattice) -> Association | None:
    """Return the gel at rest if the dots show it, whatever was predicted; otherwise None.

    A misplaced marker is expected at its wrong place again, and labels grown from that expectation confirm it. Without
    this check, markers lost under a contact would stay lost after it ends. A gel last seen nearer to the next pitch
    than to rest may have moved on by a whole one, so the hypotheses decide.
    """
    if np.abs(np.median(trusted - lattice.home_px, axis=0)).max() > 0.5 * lattice.pitch_px:
        return None
    to_dot = dots[None, :, :] - lattice.home_px[:, None, :]
    squared = np.einsum("nmk,nmk->nm", to_dot, to_dot)
    # No dot is this near to two places, which are a pitch apart.
    found = squared.min(axis=1) < (HOME * lattice.pitch_px) ** 2
    if np.count_nonzero(~found) > LACKING_DOTS:
        return None
    nearest = squared.argmin(axis=1)
    at = np.where(found[:, None], dots[nearest], lattice.home_px)
    return Association(np.where(found, nearest, -1), at, False, np.ones(lattice.count, bool))


@dataclass(frozen=True, slots=True, eq=False)
class _Hypothesis:
    """One shift of all labels: its cost, the number of dots against it, each marker's dot and expected place."""

    cost: float
    against: int
    dot: NDArray[np.intp]
    expected_px: NDArray[np.float64]


def _labelled(
    extended: NDArray[np.float64], dots: NDArray[np.float64], lattice: Lattice, trusted: NDArray[np.float64]
) -> NDArray[np.intp]:
    """Label the extended lattice's nodes from where they are predicted, or from where they were last certain.

    A gel that bounces turns round between two frames. The prediction then tears the grid where it moves most, and fewer
    labels grow from it. The others count only if they leave almost no marker without a dot: on a gel that jumps by more
    than a pitch, more labels are no better ones.
    """
    label = _labelled_from(extended, dots, lattice)
    if _lacks_few(label, lattice):
        return label
    other = _labelled_from(lattice.extend(trusted), dots, lattice)
    return other if _lacks_few(other, lattice) else label


def _lacks_few(label: NDArray[np.intp], lattice: Lattice) -> bool:
    """Return whether almost all markers have a dot."""
    return bool(np.count_nonzero(label[: lattice.count] < 0) <= LACKING_DOTS)


def _labelled_from(extended: NDArray[np.float64], dots: NDArray[np.float64], lattice: Lattice) -> NDArray[np.intp]:
    """Label the extended lattice's nodes from one expectation: all at once if the gel has moved alike, or grown."""
    label = _carried(extended, dots, lattice)
    return _grow(extended, dots, lattice) if label is None else label


def _carried(extended: NDArray[np.float64], dots: NDArray[np.float64], lattice: Lattice) -> NDArray[np.intp] | None:
    """Label the extended lattice's nodes if the whole gel has moved alike; otherwise None.

    Usually the whole gel leaps. Then the offsets of all markers to their nearest dots agree to a fraction of a pitch,
    and growing labels over the grid would give the same result.
    """
    to_dot = dots[None, :, :] - extended[:, None, :]
    nearest = np.einsum("nmk,nmk->nm", to_dot, to_dot).argmin(axis=1)
    inner = lattice.count
    moved = to_dot[np.arange(inner), nearest[:inner]]
    ranked = np.sort(moved, axis=0)
    middle = ranked[inner // 2]
    off = np.abs(moved - middle)
    if off.max() > ALIKE * lattice.pitch_px or np.bincount(nearest[:inner]).max() > 1:
        return None
    label = np.full(len(extended), -1)
    label[:inner] = nearest[:inner]
    # Dots in the ring around the markers that belong to no marker.
    away = dots[None, :, :] - (extended[inner:] + middle)[:, None, :]
    squared = np.einsum("nmk,nmk->nm", away, away)
    squared[:, nearest[:inner]] = np.inf
    if squared.size:
        found = squared.argmin(axis=1)
        near = squared[np.arange(len(found)), found] <= (GROW_GATE * lattice.pitch_px) ** 2
        if np.bincount(found[near], minlength=1).max() > 1:
            return None
        label[inner:][near] = found[near]
    return label


def _grow(extended: NDArray[np.float64], dots: NDArray[np.float64], lattice: Lattice) -> NDArray[np.intp]:
    """Label the extended lattice's nodes (markers and the empty ring around them), wave by wave from the best seed.

    Where nothing else grows, the empty nodes around a marker without neighbours pass on the motion of those around
    them, so that the growth reaches that marker, or leaves it.
    """
    neighbour, has = lattice.neighbour, lattice.has_neighbour
    gate = (GROW_GATE * lattice.pitch_px) ** 2
    label = np.full(len(extended), -1)
    moved = np.zeros_like(extended)
    tried_with = np.zeros(len(extended), np.intp)

    to_dot = dots[None, :, :] - extended[: lattice.count, None, :]
    squared = np.einsum("nmk,nmk->nm", to_dot, to_dot)
    nearest = squared.argmin(axis=1)
    alone = to_dot[np.arange(lattice.count), nearest]
    marker = np.minimum(neighbour[: lattice.count], lattice.count - 1)
    around = np.where(has[: lattice.count, :, None], alone[marker], 0)
    inner = has[: lattice.count] & (neighbour[: lattice.count] < lattice.count)
    unlike = np.hypot(*(around - alone[:, None, :]).transpose(2, 0, 1)) * inner
    score = np.hypot(alone[:, 0], alone[:, 1]) + unlike.sum(axis=1) / np.maximum(inner.sum(axis=1), 1)
    seed = int(score.argmin())
    label[seed], moved[seed] = nearest[seed], alone[seed]

    free = np.ones(len(dots), bool)
    free[label[seed]] = False
    passed = np.zeros(len(extended), bool)
    while True:
        known = has & (passed | (label >= 0))[neighbour]
        support = known.sum(axis=1)
        todo = np.flatnonzero((label < 0) & (support > tried_with))
        grows = len(todo) > 0
        if not grows:
            todo = np.flatnonzero(lattice.bridge & (label < 0) & ~passed & (support > 0))
            if not len(todo) or not free.any():
                return label
        weight = known[todo] / support[todo, None]
        motion = np.einsum("tk,tkd->td", weight, moved[neighbour[todo]])
        if not grows:
            moved[todo], passed[todo] = motion, True
            continue
        tried_with[todo] = support[todo]
        guess = extended[todo] + motion
        to_dot = dots[None, :, :] - guess[:, None, :]
        squared = np.einsum("nmk,nmk->nm", to_dot, to_dot)
        squared[:, ~free] = np.inf
        nearest = squared.argmin(axis=1)
        distance = squared[np.arange(len(todo)), nearest]
        for i in np.argsort(distance, kind="stable").tolist():
            dot = nearest[i]
            if distance[i] > gate:
                break
            if free[dot]:
                free[dot] = False
                label[todo[i]] = dot
                moved[todo[i]] = dots[dot] - extended[todo[i]]


class _Seen(NamedTuple):
    """Inputs that all hypotheses share; see `associate`. `grown` (nodes,) dot of each node, -1 for none."""

    grown: NDArray[np.intp]
    extended: NDArray[np.float64]
    dots: NDArray[np.float64]
    lattice: Lattice
    trusted: NDArray[np.float64]
    hidden: NDArray[np.bool_] | None


def _hypotheses(shifts: Sequence[tuple[int, int]], seen: _Seen) -> list[_Hypothesis]:
    """Return a hypothesis for each shift: the true cell of every grown label is its cell plus the shift.

    Shifts that explain too few dots are left out. All shifts are computed at once, because frames after a leap take the
    longest.
    """
    lattice, count = seen.lattice, seen.lattice.count
    source = np.stack([lattice.shifted(shift) for shift in shifts])
    label = np.where(source >= 0, seen.grown[source], -1)
    enough = np.count_nonzero(label[:, :count] >= 0, axis=1) >= max(4, count // 4)
    shifts = [shift for shift, good in zip(shifts, enough.tolist(), strict=True) if good]
    if not shifts:
        return []
    label = label[enough]
    dot = label[:, :count]
    found = dot >= 0
    predicted, trusted = seen.extended[:count], seen.trusted
    at = seen.dots[dot]
    carried = _middles(at - predicted, found)
    expected = np.where(found[..., None], at, predicted + carried[:, None, :])
    unseen = ~found & lattice.in_view(expected, _BORDER_EDGE_PX)
    if seen.hidden is not None and unseen.any():
        column, row = (expected[unseen] * (1 / HALF)).astype(np.intp).T
        unseen[unseen] = ~seen.hidden[row, column]
    if lattice.complete:
        surplus = [np.count_nonzero(seen.grown[lattice.dropped(shift)] >= 0) for shift in shifts]
    else:
        surplus = np.count_nonzero((label[:, count:] >= 0) & lattice.known_empty, axis=1).tolist()
    missing = np.count_nonzero(unseen, axis=1).tolist()
    moved = _middles(at - trusted, found)
    foretold = _middles(np.broadcast_to(predicted - trusted, at.shape), found)
    share = found.mean(axis=1)
    away = _away(trusted, lattice)
    hypotheses = []
    for i in range(len(shifts)):
        against = int(missing[i] + surplus[i])
        cost = MISS_WEIGHT * against + MOTION_WEIGHT * _off_segment(moved[i], foretold[i]) / lattice.pitch_px**2
        if share[i] == 1 or (share[i] >= HOME_SHARE and away):
            # All dots in place, or most of them if the gel was away, prove that the gel is at rest. Most dots alone do
            # not: after a jump by a pitch, all but a line of dots seem not to have moved.
            off = np.abs(at[i] - lattice.home_px)[found[i]].max()
            if float(off) < HOME * lattice.pitch_px:
                cost = float(-COST_MARGIN)
        hypotheses.append(_Hypothesis(cost, against, dot[i], expected[i]))
    return hypotheses


def _middles(values: NDArray[np.float64], found: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the median (S, 2) of the values (S, N, 2) that are found (S, N); the upper of two middle values."""
    ranked = np.where(found[..., None], values, np.inf)
    ranked.sort(axis=1)
    return np.asarray(ranked[np.arange(len(ranked)), np.count_nonzero(found, axis=1) // 2])


def _away(trusted: NDArray[np.float64], lattice: Lattice) -> bool:
    """Return whether the gel as a whole was last away from rest."""
    moved = np.median(trusted - lattice.home_px, axis=0)
    return float(np.abs(moved).max()) > 2 * HOME * lattice.pitch_px


def _off_segment(point: NDArray[np.float64], end: NDArray[np.float64]) -> float:
    """Squared distance of a point from the segment between the origin and `end`."""
    length = float(end @ end)
    share = min(1.0, max(0.0, float(point @ end) / length)) if length > 0 else 0.0
    off = point - share * end
    return float(off @ off)
