"""Friction between the object's surface and the gel: static and kinetic coefficients, Stribeck fall, texture."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.plant.texture import Chatter, Texture


CREEP_M_S = 1e-4
"""Speed below which the Stribeck term is 1 to four digits, so that friction equals the static value."""

LEAST_KINETIC_SHARE = 0.3
"""Sliding friction never falls below this fraction of the kinetic coefficient."""


class SurfaceFriction:
    """Friction coefficients at points of the gel, with a cache for the present set of points.

    A point at rest has the static coefficient; one that slid in the last step has
    mu_k (1 + chatter) + (mu_s - mu_k) exp(-(v / v_s)^2) (Stribeck), at most the static one; both times the texture
    under the point. The chatter, too, grows with speed as the Stribeck term fades.
    """

    def __init__(
        self,
        texture: Texture,
        *,
        static: float,
        kinetic: float,
        stribeck_m_s: float,
        chatter: Chatter,
        chatter_amplitude: float,
    ) -> None:
        self._dry = (static, kinetic)
        self.static, self.kinetic = self._dry
        self._stribeck = stribeck_m_s
        self._texture = texture
        self._chatter = chatter
        self._amplitude = chatter_amplitude
        self._points: NDArray[np.float64] | None = None
        self._index = np.zeros(0, np.intp)
        self._factor = self._out = np.zeros(0)
        self._crept_on: int | None = None

    def scale(self, factor: float) -> None:
        """Set both coefficients to `factor` times their initial values, as for a wet surface."""
        if factor * self._dry[0] != self.static:
            self.static, self.kinetic = factor * self._dry[0], factor * self._dry[1]
            self._crept_on = None

    def changed(self, points_m: NDArray[np.float64], travel_m: float, speed_m_s: float) -> bool:
        """Return whether `at` would return new values; False while the patch creeps over one row of the texture."""
        if points_m is not self._points:
            self._points = points_m
            self._index = self._texture.index(points_m[0], points_m[1])
            self._factor, self._out = np.ones(points_m.shape[1]), np.ones(points_m.shape[1])
            self._crept_on = None
        row = self._texture.row(travel_m)
        creeping = abs(speed_m_s) < CREEP_M_S
        same = creeping and self._crept_on == row
        self._crept_on = row if creeping else None
        return not same

    def at(
        self, points_m: NDArray[np.float64], travel_m: float, sliding: NDArray[np.bool_], speed_m_s: float
    ) -> NDArray[np.float64]:
        """Return coefficients (N,) at points (2, N) of the gel, valid until the next call."""
        if points_m is not self._points:
            self.changed(points_m, travel_m, speed_m_s)
        moving = self.sliding_coefficient(travel_m, speed_m_s)
        np.multiply(sliding, moving - self.static, out=self._out)
        self._out += self.static
        self._out *= self._texture.at(self._index, travel_m, self._factor)
        return self._out

    def sliding_coefficient(self, travel_m: float, speed_m_s: float) -> float:
        """Return the coefficient of sliding points before texture."""
        if abs(speed_m_s) < CREEP_M_S:
            return self.static
        speed_share = 1.0 - math.exp(-((speed_m_s / self._stribeck) ** 2))
        kinetic = self.kinetic * (1.0 + self._amplitude * self._chatter.at(travel_m))
        moving = self.static + (kinetic - self.static) * speed_share
        return min(max(moving, LEAST_KINETIC_SHARE * self.kinetic), self.static)
