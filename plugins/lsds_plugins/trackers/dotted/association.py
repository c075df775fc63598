"""Which dot of this frame is which dot of the reference, where prediction alone does not say.

Dots repeat every pitch, so a wrong match one pitch away looks perfect to optical flow, forward-backward checks
included. Two things do tell: a gel does not tear, so neighbours move nearly alike; and a pad has an edge, so under a
wrong shift a whole row or column goes missing in plain view. Labels are grown over the grid from the best-predicted
marker, then every shift by one pitch competes; where the runner-up is close, the answer is "ambiguous".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds.tactile.views import HALF

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_plugins.trackers.dotted.lattice import Lattice

#: How far, in pitches, a dot may lie from where its labelled neighbours expect it.
GROW_GATE = 0.35
#: Weight of a marker that should be in view and is not, of a dot that should not be there, and of the squared
#: sudden motion (in pitches): a lost column of seven outweighs a jump of a whole pitch.
MISS_WEIGHT = 1.5
MOTION_WEIGHT = 8.0
#: A hypothesis must beat every other by this much to be believed, and no other may explain this many more dots.
MARGIN = 3.0
EVIDENCE = 4
#: With nothing against it and this little motion (a quarter pitch), no shift by a pitch can come near.
CALM = MOTION_WEIGHT * 0.25**2
#: All dots within this many pitches of the reference are the gel at rest.
HOME = 0.15
MOST = 0.8
_EDGE_PX = 1.0
_SHIFTS = [(row, column) for row in (-1, 0, 1) for column in (-1, 0, 1) if row or column]


@dataclass(frozen=True, slots=True, eq=False)
class Association:
    """Result of matching.

    `dot` (N,) index of each marker's dot, -1 where it has none; `expected_px` (N, 2) where each marker is, or would
    be; `ambiguous` true where a shift by a pitch explains the picture about as well.
    """

    dot: NDArray[np.intp]
    expected_px: NDArray[np.float64]
    ambiguous: bool


def associate(
    predicted_px: NDArray[np.float64],
    dots_px: NDArray[np.float64],
    lattice: Lattice,
    trusted_px: NDArray[np.float64],
    hidden: NDArray[np.bool_] | None = None,
) -> Association:
    """Match predicted markers (N, 2) with dots (M, 2) found in the frame.

    `trusted_px` (N, 2) is where the markers were when last they were sure; the gel may have stopped anywhere on the
    way from there to the prediction, so motion is held against a hypothesis only beyond that way. `hidden` (half-size
    image) tells where a dot could not be seen if it were there: saturated or black places say nothing.
    """
    count = len(predicted_px)
    if not len(dots_px):
        return Association(np.full(count, -1), predicted_px, True)
    extended = lattice.extend(predicted_px)
    grown = _grow(extended, dots_px, lattice)
    calm = _hypothesis((0, 0), grown, extended, dots_px, lattice, trusted_px, hidden)
    if calm is not None and calm.against == 0 and calm.cost < CALM:
        return Association(calm.dot, calm.expected_px, False)
    candidates = [calm, *(_hypothesis(s, grown, extended, dots_px, lattice, trusted_px, hidden) for s in _SHIFTS)]
    rivals = sorted((c for c in candidates if c is not None), key=lambda c: c.cost)
    if not rivals:
        return Association(np.full(count, -1), predicted_px, True)
    best = rivals.pop(0)
    ambiguous = any(rival.cost < best.cost + MARGIN or _explains(rival, best) for rival in rivals)
    return Association(best.dot, best.expected_px, ambiguous)


def _explains(rival: _Hypothesis, best: _Hypothesis) -> bool:
    """Tell whether a rival leaves next to nothing unexplained where the best leaves a whole line of dots.

    A torn or dazzled stretch of gel leaves something unexplained under every shift; a jump by a pitch does not.
    """
    return rival.against <= best.against - EVIDENCE and rival.against <= max(1, best.against // 5)


@dataclass(frozen=True, slots=True, eq=False)
class _Hypothesis:
    """One shift of all labels: what it costs, how many dots speak against it, what it says."""

    cost: float
    against: int
    dot: NDArray[np.intp]
    expected_px: NDArray[np.float64]


def _grow(extended: NDArray[np.float64], dots: NDArray[np.float64], lattice: Lattice) -> NDArray[np.intp]:
    """Label the extended lattice's nodes (markers and the empty ring around them), wave by wave from the best seed."""
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
    while True:
        known = has & (label[neighbour] >= 0)
        support = known.sum(axis=1)
        todo = np.flatnonzero((label < 0) & (support > tried_with))
        if not len(todo):
            return label
        tried_with[todo] = support[todo]
        weight = known[todo] / support[todo, None]
        guess = extended[todo] + np.einsum("tk,tkd->td", weight, moved[neighbour[todo]])
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


def _hypothesis(
    shift: tuple[int, int],
    grown: NDArray[np.intp],
    extended: NDArray[np.float64],
    dots: NDArray[np.float64],
    lattice: Lattice,
    trusted: NDArray[np.float64],
    hidden: NDArray[np.bool_] | None,
) -> _Hypothesis | None:
    """What follows if the true cell of every grown label were its cell plus `shift`."""
    source = lattice.shifted(shift)
    label = np.where(source >= 0, grown[source], -1)
    dot = label[: lattice.count]
    found = dot >= 0
    if found.sum() < max(4, lattice.count // 4):
        return None
    predicted = extended[: lattice.count]
    carried = np.median((dots[dot] - predicted)[found], axis=0)
    expected = np.where(found[:, None], dots[dot], predicted + carried)
    unseen = ~found & lattice.in_view(expected, _EDGE_PX)
    if hidden is not None and unseen.any():
        column, row = (expected[unseen] * (1 / HALF)).astype(np.intp).T
        unseen[unseen] = ~hidden[row, column]
    missing = np.count_nonzero(unseen)
    if lattice.complete:
        surplus = np.count_nonzero(grown[lattice.dropped(shift)] >= 0)
    else:
        surplus = np.count_nonzero((label[lattice.count :] >= 0) & lattice.known_empty)
    motion = _off_segment(
        np.median((dots[dot] - trusted)[found], axis=0), np.median((predicted - trusted)[found], axis=0)
    )
    against = int(missing + surplus)
    cost = MISS_WEIGHT * against + MOTION_WEIGHT * motion / lattice.pitch_px**2
    if found.all() or (found.mean() >= MOST and _away(trusted, lattice)):
        # Every dot back in its place, or most of them where the gel was away: an elastic gel at rest needs no other
        # witness. Most alone would not do: after a jump by a pitch, all but a line of dots seem not to have moved.
        off = np.abs(dots[dot] - lattice.home_px)[found].max()
        if float(off) < HOME * lattice.pitch_px:
            cost = float(-MARGIN)
    return _Hypothesis(cost, against, np.where(found, dot, -1), expected)


def _away(trusted: NDArray[np.float64], lattice: Lattice) -> bool:
    """Tell whether the gel as a whole was last seen away from rest."""
    moved = np.median(trusted - lattice.home_px, axis=0)
    return float(np.abs(moved).max()) > 2 * HOME * lattice.pitch_px


def _off_segment(point: NDArray[np.float64], end: NDArray[np.float64]) -> float:
    """Squared distance of a point from the segment between the origin and `end`."""
    length = float(end @ end)
    share = min(1.0, max(0.0, float(point @ end) / length)) if length > 0 else 0.0
    off = point - share * end
    return float(off @ off)
