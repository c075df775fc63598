"""Registers the imprint of one frame on that of another, relative to the motion of the gel.

The registration minimises the squared difference of the reliefs at the edges of the first, which move with the gel. It
estimates a rigid motion and a gain (the imprint fades and grows), from coarse to fine, by the inverse compositional
Gauss-Newton method (Baker and Matthews 2004) with weights that suppress outliers (Geman and McClure 1987). The normal
equations are the information on each direction: an edge gives none along itself, a disc none about its axis. In such
directions a weak prior for no slip decides.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

from lsds.tactile.imprint.layers import COUNT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lsds.tactile.imprint.carrying import CarriedGel
    from lsds.tactile.imprint.layers import Layer, Layers

    Floats = NDArray[np.float64]

#: Noise of the curvature, finest layer first: a pixel with more than three times this is an outlier.
CURVATURE_NOISE = (0.020, 0.015, 0.010)
#: Standard deviations of the prior: slip x, y (relief px), turn (rad), gain.
PRIOR_STD = (20.0, 20.0, 0.3, 0.5)
#: Maximum number of steps per layer.
MOST_STEPS = 6
#: Motion of an edge in a step below which the layer has converged, px of the layer.
SETTLED = 0.02
#: Maximum motion of an edge in a step, px of the layer: beyond it the gradient is meaningless.
LONGEST_STEP = 6.0
#: Slip at which a registration is given up, relief px.
FARTHEST_SLIP_PX = 60.0
#: Turn at which a registration is given up, rad.
WIDEST_TURN = 1.0
#: Minimum and maximum gain.
GAINS = (0.3, 3.0)


class Registered(NamedTuple):
    """A registration. `slip` (x, y in relief px; turn in rad, clockwise on the image) is about the given centre.

    `information` (3, 3) is the inverse covariance of the slip for white noise of unit variance. `match` is the
    correlation of the two reliefs at the edges, `seen` the share of the edges that the second relief shows, and `gain`
    the factor by which the imprint is stronger in it. `residual` and `strength` are the RMS of the difference and of
    the first relief.
    """

    slip: tuple[float, float, float]
    information: Floats
    match: float
    seen: float
    gain: float
    residual: float
    strength: float


class Registration:
    """The registration of `second` on `first`, relative to the gel; each layer is prepared once, on first use.

    `centre` is in relief px, and `px` is the number of image px per relief px.
    """

    def __init__(self, first: Layers, second: Layers, gel: CarriedGel, centre: tuple[float, float], px: float) -> None:
        self._given = first, second, gel, centre, px
        self._problems: dict[int, _Problem | _CompiledProblem | None] = {}

    def at_rest(self) -> Registered | None:
        """Return the registration without slip; None if there are no edges."""
        problem = self._problem(0)
        return None if problem is None else problem.registered(_NOTHING, 1.0, problem.at_rest)

    def slipped(self, start: tuple[float, float, float] = (0.0, 0.0, 0.0), layers: int = COUNT) -> Registered | None:
        """Return the registration from a start (relief px, rad) by the `layers` finest layers, the finest last."""
        slip, last = start, None
        for level in reversed(range(layers)):
            problem = self._problem(level)
            if problem is None:
                continue
            slip, gain, compared = problem.solve(slip)
            last = problem, gain, compared
            if not (math.hypot(slip[0], slip[1]) < FARTHEST_SLIP_PX and abs(slip[2]) < WIDEST_TURN):
                break
        if last is None:
            return None
        problem, gain, compared = last
        found: Registered = problem.registered(slip, gain, compared)
        return found

    def _problem(self, level: int) -> Any:
        if level not in self._problems:
            first, second, gel, centre, px = self._given
            enough = len(first[level].edges) >= _LEAST_EDGES
            make = _CompiledProblem if first[level].compiled else _Problem
            self._problems[level] = (
                make(first[level], second[level], gel, centre, px, CURVATURE_NOISE[level]) if enough else None
            )
        return self._problems[level]


#: Motion of an imprint at rest: x, y (relief px) and turn (rad).
_NOTHING = (0.0, 0.0, 0.0)
#: Minimum number of edge pixels of a layer that takes part; chosen.
_LEAST_EDGES = 20


class _Compared(NamedTuple):
    """Curvature and weight (n,) of the second relief at the slipped edges of the first.

    `normal` (4, 5) are the normal equations, with the right-hand side as last column.
    """

    shown: NDArray[np.float32]
    weight: NDArray[np.float32]
    normal: Floats


class _Problem:
    """The registration of one layer; lengths in its pixels."""

    def __init__(
        self,
        first: Layer,
        second: Layer,
        gel: CarriedGel,
        centre: tuple[float, float],
        px: float,
        noise: float,
    ) -> None:
        edges = first.edges
        step = first.step
        self._first, self._second, self._step = edges, second, step
        carried = gel.at(edges.x, edges.y, step * px)
        self._centre = (centre[0] / step, centre[1] / step)
        #: Positions (3, n) of the edges about the centre, with a row of ones: one product turns and moves them all.
        self._places = np.ones((3, len(edges.x)), np.float32)
        x, y, _ = self._places
        np.add(edges.x, carried[:, 0], out=x)
        np.add(edges.y, carried[:, 1], out=y)
        x -= np.float32(self._centre[0])
        y -= np.float32(self._centre[1])
        self._radius = math.sqrt(float(x.dot(x) + y.dot(y)) / len(x)) + 1.0
        #: Derivatives (4, n) of the difference by motion along x and y, turn and gain; the fifth row is the difference.
        self._rows = np.empty((5, len(x)), np.float32)
        along_x, along_y = edges.along
        self._rows[0], self._rows[1] = along_x, along_y
        np.multiply(along_y, x, out=self._rows[2])
        self._rows[2] -= along_x * y
        self._rows[3] = edges.curvature
        outlier, self._prior = robustness(noise, step)
        self._outlier = np.float32(outlier)

    @cached_property
    def at_rest(self) -> _Compared:
        """The comparison of the reliefs without slip."""
        return self._compared(0.0, 0.0, 0.0, 1.0)

    def solve(self, start: tuple[float, float, float]) -> tuple[tuple[float, float, float], float, _Compared]:
        """Return slip (relief px, rad) and gain from a start, and the last comparison of the reliefs."""
        x, y, turn = start[0] / self._step, start[1] / self._step, start[2]
        gain, compared = 1.0, self.at_rest if start == _NOTHING else self._compared(x, y, turn, 1.0)
        for _ in range(MOST_STEPS):
            cos, sin = math.cos(turn), math.sin(turn)
            full = compared.normal.copy()
            full[:, 4] += self._prior * (cos * x + sin * y, cos * y - sin * x, turn, 1.0 - gain)
            full.flat[:19:6] += self._prior
            _, step = cv2.solve(full[:, :4], full[:, 4:])
            d_x, d_y, d_turn, d_gain = step.ravel().tolist()
            gain = min(max(gain + d_gain, GAINS[0]), GAINS[1])
            d_x, d_y, d_turn = d_x / gain, d_y / gain, d_turn / gain
            length = max(abs(d_x), abs(d_y), abs(d_turn) * self._radius)
            if length > LONGEST_STEP:
                d_x, d_y, d_turn = (part * LONGEST_STEP / length for part in (d_x, d_y, d_turn))
            # The step moves the first relief; its inverse moves the second.
            turn -= d_turn
            cos, sin = math.cos(turn), math.sin(turn)
            x, y = x - (cos * d_x - sin * d_y), y - (sin * d_x + cos * d_y)
            if length < SETTLED:
                break
            compared = self._compared(x, y, turn, gain)
        return (x * self._step, y * self._step, turn), gain, compared

    def _compared(self, x: float, y: float, turn: float, gain: float) -> _Compared:
        cos, sin = math.cos(turn), math.sin(turn)
        move = np.array([[cos, -sin, self._centre[0] + x], [sin, cos, self._centre[1] + y]], np.float32)
        at_x, at_y = move @ self._places
        shown = np.asarray(cv2.remap(self._second.curvature, at_x, at_y, cv2.INTER_LINEAR), np.float32).ravel()
        weight = np.asarray(cv2.remap(self._second.weight, at_x, at_y, cv2.INTER_LINEAR), np.float32).ravel()
        weight *= self._first.weight
        rows, curvature = self._rows, self._first.curvature
        difference = np.subtract(shown, curvature if gain == 1.0 else np.float32(gain) * curvature, out=rows[4])
        trust = difference * difference
        trust *= self._outlier
        trust += np.float32(1)
        trust *= trust
        np.divide(weight, trust, out=trust)
        normal = ((rows[:4] * trust) @ rows.T).astype(np.float64)
        return _Compared(shown, weight, normal)

    @cached_property
    def _squared(self) -> NDArray[np.float32]:
        return np.asarray(self._first.curvature * self._first.curvature)

    def registered(self, slip: tuple[float, float, float], gain: float, compared: _Compared) -> Registered:
        """Return the registration for a slip (relief px, rad) and a gain."""
        shown, weight, normal = compared
        first = self._first
        weighted = weight * shown
        own, both, other = float(weight @ self._squared), float(weighted @ first.curvature), float(weighted @ shown)
        difference = shown - np.float32(gain) * first.curvature
        left = float((weight * difference) @ difference)
        return registered(slip, gain, normal, (own, both, other, left, float(weight.sum())), first.weights, self._step)


class _CompiledProblem:
    """The registration of one layer by compiled functions; lengths in its pixels."""

    def __init__(
        self,
        first: Layer,
        second: Layer,
        gel: CarriedGel,
        centre: tuple[float, float],
        px: float,
        noise: float,
    ) -> None:
        self._edges, self._second, self._step = first.edges, second, first.step
        self._centre = (centre[0] / self._step, centre[1] / self._step)
        self._places, self._radius = gel.places(self._edges.table, self._step * px, self._centre)
        self._outlier, self._prior = robustness(noise, self._step)

    @cached_property
    def at_rest(self) -> Floats:
        """The comparison of the reliefs without slip."""
        return self._registered(_NOTHING, 0, _UNKNOWN)

    def solve(self, start: tuple[float, float, float]) -> tuple[tuple[float, float, float], float, Floats]:
        """Return slip (relief px, rad) and gain from a start, and the last comparison of the reliefs."""
        step = self._step
        known = self.at_rest if start == _NOTHING else _UNKNOWN
        answer = self._registered((start[0] / step, start[1] / step, start[2]), MOST_STEPS, known)
        x, y, turn, gain = answer[:4].tolist()
        return (x * step, y * step, turn), gain, answer

    def _registered(self, start: tuple[float, float, float], most: int, known: Floats) -> Floats:
        from lsds.tactile.compiled.registration import registered as compare

        limits = (most, SETTLED, LONGEST_STEP, *GAINS)
        second = self._second
        answer: Floats = compare(
            self._edges.table,
            self._places,
            second.curvature,
            second.weight,
            self._centre,
            start,
            self._prior,
            self._outlier,
            self._radius,
            limits,
            known,
        )
        return answer

    def registered(self, slip: tuple[float, float, float], gain: float, compared: Floats) -> Registered:
        """Return the registration for a slip (relief px, rad) and a gain."""
        sums = compared[24:].tolist()
        return registered(slip, gain, compared[4:24].reshape(4, 5), sums, self._edges.weights, self._step)


#: No comparison known at the start.
_UNKNOWN = np.empty(0)


def robustness(noise: float, step: float) -> tuple[float, Floats]:
    """Return the factor on squared differences that makes them outliers, and the precision (4,) of the prior.

    `noise` is that of a layer whose pixels are `step` relief pixels wide.
    """
    spread = np.array([PRIOR_STD[0] / step, PRIOR_STD[1] / step, PRIOR_STD[2], PRIOR_STD[3]])
    return 1 / (3 * noise) ** 2, (2 * noise / spread) ** 2


def registered(
    slip: tuple[float, float, float], gain: float, normal: Floats, sums: Sequence[float], whole: float, step: float
) -> Registered:
    """Return the registration for a slip (relief px, rad) and a gain.

    `normal` (4, 5) are the normal equations of a layer whose pixels are `step` relief pixels wide. `sums` are weighted
    sums of squares: the first relief's, the product's, the second's, the difference's; and that of the weights, which
    is `whole` if all edges are in view.
    """
    own, both, other, left, total = sums
    per_px = np.array([1 / step, 1 / step, 1.0])
    return Registered(
        slip,
        normal[:3, :3] * (per_px[:, None] * per_px),
        both / math.sqrt(own * other) if own > 0 and other > 0 else 0.0,
        total / max(whole, 1e-9),
        gain,
        math.sqrt(left / max(total, 1e-9)),
        math.sqrt(own / max(total, 1e-9)),
    )
