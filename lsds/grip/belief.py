"""One belief about the grip: the load to be carried, the friction limit, and whether the object sticks or slides.

A grid over (ln W, ln r) times {stick, slide}: W is the load that the object will exert (N a finger), r the friction
limit in units of load over squeeze^p, so the limit at a squeeze s is r s^p. The measured load F enters as

    stick    F = W where the object hangs, or less than W while it is still being loaded; below the limit
    slide    F = r s^p / kappa, the kinetic friction; the object stops where that exceeds W

Only a new greatest F / s^p is evidence on r while the object sticks: the same stick in a hundred frames proves no more
than in one. Detector and estimator enter as a log-likelihood ratio of slide against stick (`lsds.grip.evidence`).
Equations and figures: `docs/grip.md`. `POWER` and `KINETIC` are those of the simulated cell; the other constants were
chosen on draws 0, 1000 and 1001 of the random objects. There is no procedure yet that identifies them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

STEP = 0.1
"""Spacing of the grid, natural logarithm."""
LOAD_N = (0.02, 25.0)
LIMIT = (0.01, 30.0)
"""Range of the load (N) and of the limit (N / mm^p)."""
POWER = 1.25
"""Normal force grows with this power of the squeeze (round contacts; 1 for flat ones)."""
KINETIC = 1.2
"""Static over kinetic friction."""
PRIOR = (0.5, 1.1)
"""The limit before anything is seen: median (N / mm^p) and standard deviation of its logarithm."""
HEAVIER = 0.4
"""The load beyond what is seen has a density that falls with this power of it."""
HANG, SLIDE = 0.1, 0.15
"""Relative standard deviations of the measured load: of an object that hangs, and that slides."""
LIMIT_STD = 0.08
"""Relative standard deviation of what a new greatest ratio says about the limit."""
STOPS_S = 0.06
"""Time in which two thirds of the slides end whose friction exceeds the load."""
LOAD_DRIFT, LIMIT_DRIFT = 0.10, 0.10
"""Standard deviation of the change of load and limit, natural logarithm per square root of a second."""
JUMPS = 0.03, 0.03
"""Jumps of the load and of friction, 1/s: a shove, a wet surface."""
LOADING = 0.3, 0.02, 0.95
"""Share of sticking objects whose load is below W: while the load rises, while it does not, and while the arm waits and
the object may stand on its support."""
STIFFNESS_N_MM = 4.0
"""Greatest rise of the load (N a finger) of an object that sticks and stands, over the way of the arm."""
RISES = 0.3
"""A load that grows by more than this share per second rises."""
UNSEEN = 0.05
"""Share of the slides of which the detector sees nothing: that it is silent says no more than this against a slide."""
FORGET_S = 2.0
"""Time in which the greatest ratio is forgotten."""


class GripBelief:
    """The belief about one grip; feed it once per round of fingers."""

    def __init__(self) -> None:
        self.load_n = np.exp(np.arange(math.log(LOAD_N[0]), math.log(LOAD_N[1]), STEP))
        self.limit = np.exp(np.arange(math.log(LIMIT[0]), math.log(LIMIT[1]), STEP))
        self._ln_w, self._ln_r = np.log(self.load_n), np.log(self.limit)
        #: ln W - ln r of each cell, as a number of steps: a load of W needs exp of it as squeeze^p.
        rows, columns = np.arange(len(self.load_n))[:, None], np.arange(len(self.limit))[None, :]
        self._needs = (rows - columns + len(self.limit) - 1).ravel()
        self._ln_need = self._ln_w[0] - self._ln_r[-1] + STEP * np.arange(len(self.load_n) + len(self.limit) - 1)
        self.reset()

    def reset(self) -> None:
        """Know nothing of the object."""
        prior_r = np.exp(-0.5 * ((self._ln_r - math.log(PRIOR[0])) / PRIOR[1]) ** 2)
        prior_w = np.exp(-HEAVIER * (self._ln_w - self._ln_w[0]))
        joint = np.outer(prior_w, prior_r)
        joint /= joint.sum()
        self.stick, self.slide = 0.98 * joint, 0.02 * joint
        self._prior_r, self._prior_w = prior_r / prior_r.sum(), prior_w / prior_w.sum()
        self._unseen = UNSEEN
        self._greatest = -math.inf
        self._last_f = self._last_s = math.nan

    @property
    def slips(self) -> float:
        """Probability that the object slides."""
        return float(self.slide.sum())

    def limit_n(self, squeeze_mm: float) -> tuple[float, float]:
        """Return the friction limit of a finger at a squeeze (N), and one standard deviation of it."""
        by_r = self.stick.sum(axis=0) + self.slide.sum(axis=0)
        mean = float(by_r @ self._ln_r)
        spread = math.sqrt(max(float(by_r @ (self._ln_r - mean) ** 2), 0.0))
        limit_n = math.exp(mean) * squeeze_mm**POWER
        return limit_n, limit_n * spread

    def update(
        self,
        load_n: float,
        squeeze_mm: float,
        dt_s: float,
        evidence: float,
        stands: bool = False,
        moved_mm: float = math.inf,
    ) -> None:
        """Take a round: load (N a finger), squeeze at the time of its frames (mm), and the detector's evidence, a
        log-likelihood ratio of slide against stick. `stands`: the arm waits, the object may stand on its support.
        `moved_mm`: by how much the arm has moved at most since the last round."""
        ln_f, ln_g = math.log(max(load_n, LOAD_N[0])), POWER * math.log(squeeze_mm)
        changed = not abs(squeeze_mm - self._last_s) < 0.02 * squeeze_mm
        rate = (ln_f - self._last_f) / dt_s if math.isfinite(self._last_f) and dt_s > 0 else 0.0
        before_n = math.exp(self._last_f) if math.isfinite(self._last_f) else math.nan
        self._last_f, self._last_s = ln_f, squeeze_mm
        slid = self.slips
        self._drift(dt_s, changed)
        self._break_away(ln_f - ln_g, dt_s)
        begun = max(self.slips - slid, 0.0)
        self._unseen = (self._unseen * slid + UNSEEN * begun) / (slid + begun)
        self._stop(ln_g, dt_s, stands)
        hang = _normal(ln_f - self._ln_w, HANG)
        below = (self._ln_w > ln_f) * max(1.0 / _RANGE, _loading(load_n, before_n, moved_mm))
        loading = LOADING[2] if stands else LOADING[0] if rate > RISES else LOADING[1]
        self.stick *= ((1 - loading) * hang + loading * below + _OUTLIER)[:, None]
        self.slide *= (_normal(ln_f - (self._ln_r + ln_g - math.log(KINETIC)), SLIDE) + _OUTLIER)[None, :]
        # An object keeps sliding only if it weighs more than friction carries; otherwise it is about to stop.
        self.slide *= (_STOPPING + (1 - _STOPPING) * _below((self._ln_w - ln_f) / SLIDE))[:, None]
        self._weigh(evidence)
        self._normalise()

    def weigh(self, evidence: float, dt_s: float) -> None:
        """Take the detector's evidence of a round in which no load is known."""
        self._drift(dt_s, changed=False)
        self._weigh(evidence)
        self._normalise()

    def squeeze_mm(self, risk: float, margin: float, ahead_n: float, braking: float = 1.0) -> float:
        """Return the least squeeze (mm) at which `margin` times the load exceeds the limit with at most this
        probability. Of what sticks the load is at most `ahead_n`, of what slides it is all that it may be, times
        `braking`."""
        most = math.log(ahead_n)
        cap = int(np.searchsorted(self._ln_w, most))
        stick = self.stick
        if cap < len(self._ln_w) - 1:
            stick = stick.copy()
            stick[cap] += stick[cap + 1 :].sum(axis=0)
            stick[cap + 1 :] = 0.0
        # A sliding object has to be stopped by kinetic friction, which carries less.
        shift = round(math.log(KINETIC * braking) / STEP)
        mass = np.bincount(self._needs, stick.ravel(), len(self._ln_need))
        sliding = np.bincount(self._needs, self.slide.ravel(), len(self._ln_need))
        mass[shift:] += sliding[: len(mass) - shift]
        beyond = np.cumsum(mass[::-1])[::-1]
        at = int(np.searchsorted(-beyond, -risk))
        at = min(at, len(self._ln_need) - 1)
        # Between two steps, linear in probability.
        upper = beyond[at - 1] if at else 1.0
        part = (upper - risk) / max(upper - beyond[at], 1e-12)
        ln_need = self._ln_need[at] - STEP * (1 - part) + math.log(margin)
        return math.exp(ln_need / POWER)

    def _weigh(self, evidence: float) -> None:
        ratio = self._unseen + (1 - self._unseen) * math.exp(min(max(evidence, -_MOST), _MOST))
        self.slide *= ratio
        self._unseen /= ratio

    def _normalise(self) -> None:
        total = self.stick.sum() + self.slide.sum()
        self.stick /= total
        self.slide /= total

    def _drift(self, dt_s: float, changed: bool) -> None:
        share = min(0.5 * dt_s * (LOAD_DRIFT / STEP) ** 2, 0.25)
        self.stick, self.slide = _spread(self.stick, share, 0), _spread(self.slide, share, 0)
        share = min(0.5 * dt_s * (LIMIT_DRIFT / STEP) ** 2, 0.25)
        sliding = min(0.5 * dt_s * (2 * LIMIT_DRIFT / STEP) ** 2, 0.25)
        self.slide = _spread(self.slide, sliding, 1)
        if changed:
            self.stick = _spread(self.stick, share, 1)
        by_w, by_r = self.stick.sum(axis=1), self.stick.sum(axis=0)
        self.stick *= 1 - (JUMPS[0] + JUMPS[1]) * dt_s
        self.slide += JUMPS[0] * dt_s * np.outer(self._prior_w, by_r) + JUMPS[1] * dt_s * np.outer(by_w, self._prior_r)

    def _break_away(self, ln_ratio: float, dt_s: float) -> None:
        """Move what a new greatest ratio has brought to its limit from stick to slide."""
        before = self._greatest
        self._greatest = max(ln_ratio, before - dt_s / FORGET_S if math.isfinite(before) else ln_ratio)
        if ln_ratio <= before:
            return
        now = _below((ln_ratio - self._ln_r) / LIMIT_STD)
        then = _below((before - self._ln_r) / LIMIT_STD) if math.isfinite(before) else np.zeros_like(now)
        hazard = np.clip((now - then) / np.maximum(1 - then, 1e-9), 0.0, 1.0)
        moved = self.stick * hazard
        self.slide += moved
        self.stick -= moved

    def _stop(self, ln_g: float, dt_s: float, stands: bool) -> None:
        """Move what friction, or the waiting arm, has stopped from slide to stick."""
        share: Floats | float = 1 - math.exp(-dt_s / STOPS_S)
        if not stands:
            exceeds = self._ln_r[None, :] + ln_g - math.log(KINETIC) - self._ln_w[:, None]
            share = _below(exceeds / LIMIT_STD) * share
        moved = self.slide * share
        self.stick += moved
        self.slide -= moved


_RANGE = math.log(LOAD_N[1] / LOAD_N[0])
_OUTLIER = 0.002
"""Density of a load that no hypothesis explains, so that one wrong frame excludes nothing."""
_MOST = 4.0
"""Greatest evidence of one frame."""
_STOPPING = 0.1
"""Share of the slides of objects that friction would carry: those that are about to stop."""


def _loading(load_n: float, before_n: float, moved_mm: float) -> float:
    """Return the density, over ln F, of the load of an object that stands and sticks: it rises only as the arm moves.

    Evenly between the load before and the most that the arm's way adds, both give or take twice the noise.
    """
    noise_n = HANG * max(load_n, before_n)
    most_n = STIFFNESS_N_MM * moved_mm
    if not -2 * noise_n < load_n - before_n < most_n + 2 * noise_n:
        return 0.0
    return load_n / (most_n + 4 * noise_n)


def _normal(x: Floats, std: float) -> Floats:
    return np.asarray(np.exp(-0.5 * (x / std) ** 2) / (std * math.sqrt(2 * math.pi)))


def _below(z: Floats) -> Floats:
    """Return the normal distribution's probability below z, by the logistic that is nearest to it."""
    return np.asarray(1 / (1 + np.exp(np.clip(-1.702 * z, -60.0, 60.0))))


def _spread(mass: Floats, share: float, axis: int) -> Floats:
    """Return the mass after one step of a random walk with a variance of 2 `share` steps^2."""
    if share <= 0:
        return mass
    out = (1 - 2 * share) * mass
    if axis == 0:
        out[1:] += share * mass[:-1]
        out[:-1] += share * mass[1:]
        out[0] += share * mass[0]
        out[-1] += share * mass[-1]
    else:
        out[:, 1:] += share * mass[:, :-1]
        out[:, :-1] += share * mass[:, 1:]
        out[:, 0] += share * mass[:, 0]
        out[:, -1] += share * mass[:, -1]
    return np.asarray(out)
