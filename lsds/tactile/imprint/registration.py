"""Registers the imprint of one frame on that of another, over and above what the gel has carried it.

Minimised is the squared difference of the reliefs at the first one's edges, each carried along by the gel's own motion,
over a rigid motion and a gain (the imprint fades and grows), from coarse to fine. It is the inverse compositional
Gauss-Newton method (Baker and Matthews 2004) with weights that forgive outliers (Geman and McClure 1987). The normal
equations are the information on each direction: an edge tells nothing along itself, a disc nothing about its axis.
There a weak prior, that nothing slips, decides.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np

from lsds.tactile.imprint.layers import COUNT

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.tactile.imprint.carrying import CarriedGel
    from lsds.tactile.imprint.layers import Layer, Layers

    Floats = NDArray[np.float64]

#: Noise of the curvature, finest layer first: beyond three times this a pixel is an outlier.
NOISE = (0.020, 0.015, 0.010)
#: Standard deviations of the prior: a slip, in relief px, a turn (rad), a gain.
PRIOR = (20.0, 20.0, 0.3, 0.5)
#: Steps per layer, and the motion of an edge (px of the layer) below which the next is not worth it.
MOST_STEPS, SETTLED = 6, 0.02
#: No step moves an edge further than this, px of the layer: beyond it the gradient says nothing.
LONGEST_STEP = 6.0
#: A registration ends where the motion has become absurd.
FURTHEST, WIDEST_TURN = 60.0, 1.0
_GAINS = (0.3, 3.0)


class Registered(NamedTuple):
    """A registration. `slip` (x, y in relief px; turn in rad, clockwise on the image) is about the given centre.

    `information` (3, 3) is the inverse covariance of the slip for white noise of unit variance; `match` the
    correlation of the two reliefs at the edges, `seen` the share of the edges that the second one shows, `gain` the
    factor by which the imprint is stronger in it, `residual` and `strength` RMS of the difference and of the first
    relief.
    """

    slip: tuple[float, float, float]
    information: Floats
    match: float
    seen: float
    gain: float
    residual: float
    strength: float


class Registration:
    """The registration of `second` on `first`, carried along by the gel; each layer is prepared once, when needed.

    `centre` in relief px, `px` image px a relief px.
    """

    def __init__(self, first: Layers, second: Layers, gel: CarriedGel, centre: tuple[float, float], px: float) -> None:
        self._given = first, second, gel, centre, px
        self._problems: dict[int, _Problem | None] = {}

    def at_rest(self) -> Registered | None:
        """Return how well the reliefs match if nothing has slipped; None where there are no edges."""
        problem = self._problem(0)
        return None if problem is None else problem.solve(_NOTHING, 0)

    def slipped(self, start: tuple[float, float, float] = (0.0, 0.0, 0.0), layers: int = COUNT) -> Registered | None:
        """Return how `second` has slipped, from a start (relief px, rad), by so many of the layers, the finest last."""
        slip, found = start, None
        for level in reversed(range(layers)):
            problem = self._problem(level)
            if problem is None:
                continue
            found = problem.solve(slip, MOST_STEPS)
            slip = found.slip
            if not (math.hypot(slip[0], slip[1]) < FURTHEST and abs(slip[2]) < WIDEST_TURN):
                break
        return found

    def _problem(self, level: int) -> _Problem | None:
        if level not in self._problems:
            first, second, gel, centre, px = self._given
            enough = len(first[level].edges.x) >= _LEAST_EDGES
            self._problems[level] = (
                _Problem(first[level], second[level], gel, centre, px, NOISE[level]) if enough else None
            )
        return self._problems[level]


_NOTHING = (0.0, 0.0, 0.0)
_LEAST_EDGES = 20


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
        step, per_px = first.step, np.float32(first.step * px)
        self._first, self._second, self._step = edges, second, step
        carried = gel.at(edges.x * per_px, edges.y * per_px) / per_px
        self._centre = (centre[0] / step, centre[1] / step)
        self._x = edges.x + carried[:, 0] - np.float32(self._centre[0])
        self._y = edges.y + carried[:, 1] - np.float32(self._centre[1])
        self._radius = float(np.sqrt((self._x.dot(self._x) + self._y.dot(self._y)) / len(self._x))) + 1.0
        #: Derivatives (4, n) of the difference by motion along x and y, turn and gain.
        self._by = np.stack(
            [edges.along_x, edges.along_y, edges.along_y * self._x - edges.along_x * self._y, edges.curvature]
        )
        self._outlier = np.float32(1 / (3 * noise) ** 2)
        spread = np.array([PRIOR[0] / step, PRIOR[1] / step, PRIOR[2], PRIOR[3]])
        self._prior = (2 * noise / spread) ** 2

    def solve(self, start: tuple[float, float, float], steps: int) -> Registered:
        """Return the registration from a start (relief px, rad)."""
        x, y, turn = start[0] / self._step, start[1] / self._step, start[2]
        gain, by = 1.0, self._by
        for taken in range(steps + 1):
            cos, sin = math.cos(turn), math.sin(turn)
            shown, weight = self._look_up(x, y, cos, sin)
            difference = shown - np.float32(gain) * self._first.curvature
            trust = 1 / (1 + difference * difference * self._outlier)
            weighted = by * (weight * trust * trust)
            moment = (weighted @ by.T).astype(np.float64)
            if taken == steps:
                break
            slope = (weighted @ difference).astype(np.float64)
            back = (cos * x + sin * y, cos * y - sin * x, turn, 1.0 - gain)
            slope += self._prior * back
            full = moment.copy()
            full.flat[::5] += self._prior
            d_x, d_y, d_turn, d_gain = np.linalg.solve(full, slope).tolist()
            gain = min(max(gain + d_gain, _GAINS[0]), _GAINS[1])
            d_x, d_y, d_turn = d_x / gain, d_y / gain, d_turn / gain
            length = max(abs(d_x), abs(d_y), abs(d_turn) * self._radius)
            if length > LONGEST_STEP:
                d_x, d_y, d_turn = (part * LONGEST_STEP / length for part in (d_x, d_y, d_turn))
            # The step moves the first relief; undone, it moves the second: compose with its inverse.
            turn -= d_turn
            cos, sin = math.cos(turn), math.sin(turn)
            x, y = x - (cos * d_x - sin * d_y), y - (sin * d_x + cos * d_y)
            if length < SETTLED:
                break
        return self._registered(x, y, turn, gain, moment, shown, weight, difference)

    def _look_up(self, x: float, y: float, cos: float, sin: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return curvature and weight (n,) of the second relief where the first one's edges would have slipped to."""
        at_x = np.float32(cos) * self._x - np.float32(sin) * self._y
        at_x += np.float32(self._centre[0] + x)
        at_y = np.float32(sin) * self._x + np.float32(cos) * self._y
        at_y += np.float32(self._centre[1] + y)
        found = np.asarray(cv2.remap(self._second.planes, at_x, at_y, cv2.INTER_LINEAR), np.float32).reshape(-1, 2)
        return found[:, 0], found[:, 1] * self._first.weight

    def _registered(
        self,
        x: float,
        y: float,
        turn: float,
        gain: float,
        moment: Floats,
        shown: NDArray[np.float32],
        weight: NDArray[np.float32],
        difference: NDArray[np.float32],
    ) -> Registered:
        step, curvature = self._step, self._first.curvature
        total = float(weight.sum())
        own, other = float(weight @ (curvature * curvature)), float(weight @ (shown * shown))
        match = float(weight @ (curvature * shown)) / math.sqrt(own * other) if own > 0 and other > 0 else 0.0
        per_px = np.array([1 / step, 1 / step, 1.0])
        return Registered(
            (x * step, y * step, turn),
            moment[:3, :3] * np.outer(per_px, per_px),
            match,
            total / max(float(self._first.weight.sum()), 1e-9),
            gain,
            math.sqrt(float(weight @ (difference * difference)) / max(total, 1e-9)),
            math.sqrt(own / max(total, 1e-9)),
        )
