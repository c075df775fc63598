"""One belief about the grip: the load to be carried, the friction limit, and whether the object sticks or slides.

A grid over (ln W, ln r) times {stick, slide}: W is the load that the object will exert (N a finger), r the friction
limit in units of load over squeeze^p, so the limit at a squeeze s is r s^p. The measured load F enters as

    stick    F = W where the object hangs, or less than W while it is still being loaded; below the limit
    slide    F = r s^p / kappa, the kinetic friction; the object stops where that exceeds W

Only a new greatest F / s^p is evidence on r while the object sticks: the same stick in a hundred frames proves no more
than in one. Detector and estimator enter as a log-likelihood ratio of slide against stick (`lsds.grip.evidence`).
Equations and figures: `docs/grip.md`. Parameters: `[grip]` (`lsds.grip.options`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lsds.grip.evidence import MOST_EVIDENCE, Evidence

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.grip.options import GripOptions

    Floats = NDArray[np.float64]

GRID_STEP = 0.1
"""Spacing of the grid, natural logarithm; chosen equal to the default of `grip.noise`."""
LOAD_RANGE_N = (0.02, 25.0)
"""Smallest and largest load W per finger on the grid, N; chosen."""
LIMIT_RANGE = (0.01, 30.0)
"""Smallest and largest friction limit r on the grid, N / mm^p; chosen."""
MEDIAN_FRICTION = 0.5
"""Median static friction of gel and object: the geometric mean, 0.47, of the range of the random objects, 0.2 to 1.1.
No friction of the gel that was measured on a bench was found."""
FRICTION_SPREAD = 0.6
"""Standard deviation of the natural logarithm of the friction: 0.5 for that range, and 0.35 for the normal force by the
imprint on a gel that is not calibrated; chosen."""
FRICTION_UNKNOWN = 0.05
"""Probability that the friction limit is independent of the normal force by the imprint; chosen."""
LEAST_FRICTION = 0.1
"""Least coefficient of friction of gel and object: half of the least of the random objects, because the normal force of
a gel that is not calibrated may be twice too great."""
NORMAL_SPREAD = 0.35
"""Relative standard deviation of the normal force by the imprint on a gel that is not calibrated; chosen, at twice the
error for spheres, the largest on simulated gels."""
WET_SHARE = 0.5
"""Least friction of a wet surface as a share of that of a dry one; chosen: that of the simulated ones (`wet_to`)."""
HEAVIER = 0.4
"""Exponent of the load by which its prior density falls; chosen."""
LOADING_RISING = 0.3
"""Share of sticking objects whose load is below W while the load rises; chosen."""
LOADING_STEADY = 0.02
"""Share of sticking objects whose load is below W while the load is steady or falls; chosen."""
STEADY_1_S = 0.3
"""Maximum relative rise per second of a steady load; chosen."""
FORGET_S = 2.0
"""Time in which the greatest ratio decays by a factor of e, s; chosen."""
WALKED_SHARE = 0.25
"""Maximum share of a cell that one step of the random walk moves to each neighbour."""
WALK_STEPS = 50
"""Maximum number of such steps at once, so that a long gap takes no long time; chosen."""
SPREAD_S = 0.1
"""Time whose drift is applied at once, s; chosen, because one application costs a third of an update."""


class _Round(NamedTuple):
    """A round as both hypotheses see it.

    `ln_f`, `ln_g` and `ln_pull`: ln of the load (N), of squeeze^p (mm^p), and of their ratio if it may have broken an
    object away. `stands`: everything may stop; `changed`: the squeeze has changed. `loading` is the share of sticking
    objects whose load is below W, and `density` that of their load; `faint`: the load is less than the given one.
    """

    ln_f: float
    ln_g: float
    ln_pull: float
    dt_s: float
    stands: bool
    changed: bool
    loading: float
    density: float
    faint: bool


class GripBelief:
    """The belief about one grip; feed it once per round of fingers. `answer_s`: the time until the fingers answer.

    `compiled` is whether compiled functions compute it (`lsds.grip.compiled_belief`).
    """

    def __init__(self, options: GripOptions, answer_s: float, *, compiled: bool = False) -> None:
        self.options, self._answer_s, self._compiled = options, answer_s, compiled
        if compiled:
            from lsds.grip.compiled_belief import prepare

            prepare()
        self._ln_kinetic = math.log(options.kinetic)
        self.load_n = np.exp(np.arange(math.log(LOAD_RANGE_N[0]), math.log(LOAD_RANGE_N[1]), GRID_STEP))
        self.limit = np.exp(np.arange(math.log(LIMIT_RANGE[0]), math.log(LIMIT_RANGE[1]), GRID_STEP))
        self._ln_w, self._ln_r = np.log(self.load_n), np.log(self.limit)
        #: ln W - ln r of each cell, as a number of steps: a load of W needs exp of it as squeeze^p.
        rows, columns = np.arange(len(self.load_n))[:, None], np.arange(len(self.limit))[None, :]
        self._needs = (rows - columns + len(self.limit) - 1).ravel()
        self._ln_need = self._ln_w[0] - self._ln_r[-1] + GRID_STEP * np.arange(len(self.load_n) + len(self.limit) - 1)
        self.reset()

    def reset(self) -> None:
        """Return to what is known of an unknown object."""
        self.power = self.options.power
        self._ln_expected = math.log(self.options.limit)
        self._by_normal: Floats | None = None
        prior_r = self._limits(self._ln_expected, self.options.spread)
        prior_w = np.exp(-HEAVIER * (self._ln_w - self._ln_w[0]))
        joint = np.outer(prior_w, prior_r)
        joint /= joint.sum()
        self.stick, self.slide = 0.98 * joint, 0.02 * joint
        self._prior_r, self._prior_w = prior_r, prior_w / prior_w.sum()
        self._unseen = self.options.unseen
        self._greatest = -math.inf
        self._drifted_s = self._changed_s = 0.0
        self._last_f = self._last_s = math.nan
        self._unmeasured_s = 0.0
        self._slips = float(self.slide.sum())

    @property
    def slips(self) -> float:
        """Probability that the object slides."""
        return self._slips

    def limit_n(self, squeeze_mm: float) -> tuple[float, float]:
        """Return the friction limit of a finger at a squeeze (N), and one standard deviation of it."""
        if self._compiled:
            from lsds.grip.compiled_belief import limit_of

            mean, spread = limit_of(self.stick, self.slide, self._ln_r)
        else:
            by_r = self.stick.sum(axis=0) + self.slide.sum(axis=0)
            mean = float(by_r @ self._ln_r)
            spread = math.sqrt(max(float(by_r @ (self._ln_r - mean) ** 2), 0.0))
        limit_n = math.exp(mean) * squeeze_mm**self.power
        return limit_n, limit_n * spread

    def update(
        self,
        load_n: float,
        squeeze_mm: float,
        dt_s: float,
        evidence: Evidence,
        stands: bool = False,
        moved_mm: float = math.inf,
        *,
        faint: bool = False,
    ) -> None:
        """Take a round: load (N a finger), squeeze at the time of its frames (mm), and the detector's evidence, a
        log-likelihood ratio of slide against stick. `stands`: the arm waits, the object may stand on its support.
        `moved_mm`: by how much the arm has moved at most since the load before. `faint`: the load is less than
        `load_n`, and not known."""
        ln_f, ln_g = math.log(max(load_n, LOAD_RANGE_N[0])), self.power * math.log(squeeze_mm)
        changed = not abs(squeeze_mm - self._last_s) < 0.02 * squeeze_mm
        since_s, self._unmeasured_s = dt_s + self._unmeasured_s, 0.0
        rate = (ln_f - self._last_f) / since_s if math.isfinite(self._last_f) and since_s > 0 else 0.0
        before_n = math.exp(self._last_f) if math.isfinite(self._last_f) else math.nan
        self._last_f, self._last_s = ln_f, squeeze_mm
        slid = self.slips
        density = max(1.0 / _RANGE, self._loading(load_n, before_n, moved_mm))
        # Nothing pulls while the arm rests, and whether a faint load rises is not known.
        stands = stands or (faint and not moved_mm > 0)
        moving = LOADING_STEADY if rate <= STEADY_1_S and not faint else LOADING_RISING
        loading = 1 - self.options.unseen if stands else moving
        ln_pull = -math.inf if faint and stands else ln_f - ln_g
        advance = self._advance_compiled if self._compiled else self._advance
        begun = advance(_Round(ln_f, ln_g, ln_pull, dt_s, stands, changed, loading, density, faint))
        self._weigh(evidence, slid, begun)

    def _advance(self, now: _Round) -> float:
        """Advance both hypotheses by a round; return how much began to slide."""
        noise, ln_f = self.options.noise, now.ln_f
        begun = self._drift(now.dt_s, now.changed) + self._break_away(now.ln_pull, now.dt_s)
        self._stop(now.ln_g, now.dt_s, now.stands)
        likely = _chance_below if now.faint else _normal
        below = 1.0 if now.faint else (self._ln_w > ln_f) * now.density
        hang = likely(ln_f - self._ln_w, noise)
        self.stick *= ((1 - now.loading) * hang + now.loading * below + _OUTLIER)[:, None]
        sliding = likely(ln_f - (self._ln_r + now.ln_g - self._ln_kinetic), SLIDING_NOISE * noise) + _OUTLIER
        # An object keeps sliding only if it weighs more than friction carries; otherwise it is about to stop.
        heavy = _STOPPING + (1 - _STOPPING) * _below((self._ln_w - ln_f) / (SLIDING_NOISE * noise))
        self.slide *= heavy[:, None] * sliding[None, :]
        return begun

    def _advance_compiled(self, now: _Round) -> float:
        """Return the same as `_advance`, by compiled functions."""
        from lsds.grip.compiled_belief import advance

        self._walk(now.dt_s, now.changed)
        before, grows = self._raise_greatest(now.ln_pull, now.dt_s)
        noise = self.options.noise
        begun: float = advance(
            self.stick,
            self.slide,
            (self._ln_w, self._ln_r, self._ln_need, self._prior_w, self._prior_r),
            self._jumps(now.dt_s),
            (before, now.ln_pull, BREAKING_NOISE * noise if grows else 0.0),
            (self._answered(now.dt_s), now.ln_g - self._ln_kinetic, 0.0 if now.stands else BREAKING_NOISE * noise),
            (now.ln_f, noise, SLIDING_NOISE * noise, now.loading, now.density),
            (_OUTLIER, _STOPPING),
            now.faint,
        )
        return begun

    def rescale(self, before_mm: float, now_mm: float) -> None:
        """Take another touch into account: what was counted as a squeeze of `before_mm` is one of `now_mm` (mm).

        The friction limit there stays.
        """
        if not (math.isfinite(before_mm) and math.isfinite(now_mm)):
            return
        self._shift_limits(self.power * math.log(before_mm / now_mm))

    def know_power(self, power: float, squeeze_mm: float) -> None:
        """Let the friction limit grow with another power of the squeeze from now on. That at `squeeze_mm` stays."""
        self._shift_limits((self.power - power) * math.log(squeeze_mm))
        self.power = power

    def _shift_limits(self, ln_shift: float) -> None:
        """Add to the logarithm of each friction limit r, of what is expected of them, and of the greatest ratio."""
        at = np.arange(len(self._ln_r)) + ln_shift / GRID_STEP
        first = np.floor(at).astype(np.int64)
        part = at - first

        def shifted(mass: Floats) -> Floats:
            # The edges of the grid keep what leaves it.
            out = np.zeros_like(mass)
            for k, share in ((0, 1 - part), (1, part)):
                np.add.at(out.T, np.clip(first + k, 0, len(first) - 1), (share * mass).T)
            return out

        self.stick, self.slide, self._prior_r = shifted(self.stick), shifted(self.slide), shifted(self._prior_r)
        # The limits of unknown objects count from the touch, too.
        self._ln_expected += ln_shift
        if self._by_normal is not None:
            self._by_normal = np.interp(self._ln_r - ln_shift, self._ln_r, self._by_normal)
        self._greatest += ln_shift

    def know_normal(self, normal_n: float, squeeze_mm: float) -> None:
        """Take the normal force at a squeeze, once for a grip: the limit is friction times it, and hardly less than
        `LEAST_FRICTION` times it.

        Friction that jumps later, as on a surface that gets wet, is about `WET_SHARE` of that.
        """
        ln_normal = math.log(normal_n) - self.power * math.log(squeeze_mm)
        before = self._limits(self._ln_expected, self.options.spread)

        def expected(share: float) -> Floats:
            limits = self._limits(ln_normal + math.log(MEDIAN_FRICTION * share), FRICTION_SPREAD)
            least = ln_normal + math.log(LEAST_FRICTION * share)
            mixed = (1 - FRICTION_UNKNOWN) * limits + FRICTION_UNKNOWN * before
            return np.asarray(mixed * (_below((self._ln_r - least) / NORMAL_SPREAD) + _OUTLIER))

        wet = expected(WET_SHARE)
        self._prior_r = wet / wet.sum()
        self._by_normal = expected(1.0) / np.maximum(before, 1e-12)
        self._multiply(self._by_normal)

    def doubt_normal(self) -> None:
        """Take back what a normal force has said: the object carries more than it could."""
        if self._by_normal is not None:
            self._multiply(1 / np.maximum(self._by_normal, 1e-12))
            self._prior_r = self._limits(self._ln_expected, self.options.spread)
            self._by_normal = None

    def _multiply(self, share: Floats) -> None:
        """Multiply the probability of each limit, and make the sum of all 1 again."""
        total = float((self.stick @ share).sum() + (self.slide @ share).sum())
        self.stick, self.slide = self.stick * (share / total), self.slide * (share / total)
        self._slips = float(self.slide.sum())

    def _limits(self, ln_middle: float, spread: float) -> Floats:
        """Return log-normal probabilities of the friction limits of the grid."""
        density = np.exp(-0.5 * ((self._ln_r - ln_middle) / spread) ** 2)
        return np.asarray(density / density.sum())

    def weigh(self, evidence: Evidence, squeeze_mm: float, dt_s: float, stands: bool = False) -> None:
        """Take the detector's evidence of a round in which no load is measured, as `update` does. The squeeze is NaN if
        it is not known. Whether friction stops an object is known only if its load was."""
        known = math.isfinite(squeeze_mm)
        slid = self.slips
        begun = self._drift(dt_s, known and not abs(squeeze_mm - self._last_s) < 0.02 * squeeze_mm)
        self._unmeasured_s += dt_s
        self._greatest -= dt_s / FORGET_S
        if known:
            self._last_s = squeeze_mm
            if math.isfinite(self._last_f):
                self._stop(self.power * math.log(squeeze_mm), dt_s, stands)
        self._weigh(evidence, slid, begun)

    def squeeze_mm(self, risk: float, margin: float, ahead_n: float, braking: float = 1.0) -> float:
        """Return the least squeeze (mm) at which `margin` times the load exceeds the limit with at most this
        probability. Of what sticks the load is at most `ahead_n`, of what slides it is all that it may be, times
        `braking`."""
        cap = min(int(np.searchsorted(self._ln_w, math.log(ahead_n))), len(self._ln_w) - 1)
        # A sliding object has to be stopped by kinetic friction, which carries less.
        shift = round((self._ln_kinetic + math.log(braking)) / GRID_STEP)
        if self._compiled:
            from lsds.grip.compiled_belief import need_of

            step = need_of(self.stick, self.slide, cap, shift, risk)
        else:
            step = self._need_of(cap, shift, risk)
        ln_need = self._ln_need[0] + GRID_STEP * step + math.log(margin)
        return math.exp(ln_need / self.power)

    def _need_of(self, cap: int, shift: int, risk: float) -> float:
        """Return the step of ln (W / r) that is exceeded with a probability of `risk`, between two steps linearly."""
        beyond = np.cumsum(self._needs_of(cap, shift)[::-1])[::-1]
        at = min(int(np.searchsorted(-beyond, -risk)), len(beyond) - 1)
        upper = beyond[at - 1] if at else 1.0
        return float(at - 1 + min((upper - risk) / max(upper - beyond[at], 1e-12), 1.0))

    def _needs_of(self, cap: int, shift: int) -> Floats:
        """Return the mass by ln (W / r): of what sticks with loads up to `cap`, and of what slides, `shift` above."""
        below = (cap + 1) * len(self._ln_r)
        mass: Floats = np.bincount(self._needs[:below], self.stick[: cap + 1].ravel(), len(self._ln_need)).astype(float)
        # Loads above the cap count as the cap.
        at_cap = self._needs[below - len(self._ln_r) : below]
        mass[at_cap] += self.stick[cap + 1 :].sum(axis=0)
        sliding = np.bincount(self._needs, self.slide.ravel(), len(self._ln_need))
        # The greatest needs may be beyond the grid: they count as the greatest on it.
        shift = min(shift, len(mass) - 1)
        mass[shift:] += sliding[: len(mass) - shift]
        mass[-1] += sliding[len(mass) - shift :].sum()
        return mass

    def _loading(self, load_n: float, before_n: float, moved_mm: float) -> float:
        """Return the density, over ln F, of the load of what stands and sticks: it rises only as the arm moves.

        Evenly between the load before and the most that the arm's way adds, both give or take twice the noise.
        """
        noise_n = self.options.noise * max(load_n, before_n)
        most_n = self.options.stiffness_n_mm * moved_mm
        if not -2 * noise_n < load_n - before_n < most_n + 2 * noise_n:
            return 0.0
        return load_n / (most_n + 4 * noise_n)

    def _weigh(self, evidence: Evidence, slid: float, begun: float) -> None:
        """Weigh slide against stick, and make the sum of all 1 again: of the slides, the shares `slid` had slid in the
        round before, and `begun` has begun since."""
        lasting, fresh = (math.exp(min(max(each, -MOST_EVIDENCE), MOST_EVIDENCE)) for each in evidence)
        # Some slides are never seen: of those the detector's silence says nothing.
        unseen, of_begun = self._unseen, self.options.unseen
        likely = slid * (unseen + (1 - unseen) * lasting) + begun * (of_begun + (1 - of_begun) * fresh)
        self._unseen = (slid * unseen + begun * of_begun) / likely
        slides = likely / (slid + begun)
        if self._compiled:
            from lsds.grip.compiled_belief import weigh

            self._slips = weigh(self.stick, self.slide, slides)
            return
        slid = slides * float(self.slide.sum())
        total = float(self.stick.sum()) + slid
        self.stick /= total
        self.slide *= slides / total
        self._slips = slid / total

    def _drift(self, dt_s: float, changed: bool) -> float:
        """Let load and limit drift and jump; return what has begun to slide."""
        self._walk(dt_s, changed)
        by_w, by_r = self.stick.sum(axis=1), self.stick.sum(axis=0)
        jumps = self._jumps(dt_s)
        self.stick *= 1 - 2 * jumps
        jumped = jumps * np.stack([self._prior_w, by_w], axis=1)
        self.slide += jumped @ np.stack([by_r, self._prior_r])
        return 2 * jumps * float(by_w.sum())

    def _jumps(self, dt_s: float) -> float:
        """Return the probability that the load, or the limit, jumps within a time."""
        return min(self.options.jumps_hz * dt_s, 0.5)

    def _walk(self, dt_s: float, changed: bool) -> None:
        """Let load and limit drift."""
        self._drifted_s += dt_s
        self._changed_s += dt_s if changed else 0.0
        if self._drifted_s > SPREAD_S:
            self.stick, self.slide = (self._walked(part, self._drifted_s, 0) for part in (self.stick, self.slide))
            # Friction drifts where the contact moves: while the object slides, and while the squeeze changes.
            self.slide = self._walked(self.slide, 4 * self._drifted_s, 1)
            if self._changed_s:
                self.stick = self._walked(self.stick, self._changed_s, 1)
            self._drifted_s = self._changed_s = 0.0

    def _walked(self, mass: Floats, drift_s: float, axis: int) -> Floats:
        """Return the mass after a random walk of that duration along an axis."""
        share = 0.5 * drift_s * (self.options.drift / GRID_STEP) ** 2
        # A step to the next cell at most: a greater variance takes several.
        steps = min(max(1, math.ceil(share / WALKED_SHARE)), WALK_STEPS)
        share = min(share / steps, WALKED_SHARE)
        for _ in range(steps):
            if self._compiled:
                from lsds.grip.compiled_belief import walk

                walk(mass, share, axis == 1)
                continue
            out, step = (1 - 2 * share) * mass, share * mass
            # The edges of the grid keep their mass.
            to, of = (out, step) if axis == 0 else (out.T, step.T)
            to[1:] += of[:-1]
            to[:-1] += of[1:]
            to[0] += of[0]
            to[-1] += of[-1]
            mass = out
        return np.asarray(mass)

    def _raise_greatest(self, ln_ratio: float, dt_s: float) -> tuple[float, bool]:
        """Note a ratio of load to squeeze^p (ln); return the greatest before, and whether this one exceeds it."""
        before = self._greatest
        self._greatest = max(ln_ratio, before - dt_s / FORGET_S if math.isfinite(before) else ln_ratio)
        return before, ln_ratio > before

    def _break_away(self, ln_ratio: float, dt_s: float) -> float:
        """Move what a new greatest ratio has brought to its limit from stick to slide; return how much."""
        before, grows = self._raise_greatest(ln_ratio, dt_s)
        if not grows:
            return 0.0
        std = BREAKING_NOISE * self.options.noise
        now = _below((ln_ratio - self._ln_r) / std)
        then = _below((before - self._ln_r) / std)
        hazard = np.clip((now - then) / np.maximum(1 - then, 1e-9), 0.0, 1.0)
        moved = self.stick * hazard
        self.slide += moved
        self.stick -= moved
        return float(moved.sum())

    def _stop(self, ln_g: float, dt_s: float, stands: bool) -> None:
        """Move what friction, or the waiting arm, has stopped from slide to stick."""
        share: Floats | float = self._answered(dt_s)
        if not stands:
            exceeds = ln_g - self._ln_kinetic - self._ln_need
            share = (_below(exceeds / (BREAKING_NOISE * self.options.noise)) * share)[self._needs].reshape(
                self.slide.shape
            )
        moved = self.slide * share
        self.stick += moved
        self.slide -= moved

    def _answered(self, dt_s: float) -> float:
        """Return the share of what friction can stop that stops within a time."""
        return 1 - math.exp(-dt_s / (self._answer_s / 2))


SLIDING_NOISE = 1.5
"""Scatter of the load of a sliding object in units of `grip.noise`; chosen above 1, because stick-slip adds to it."""
BREAKING_NOISE = 0.8
"""Scatter of the load at which an object breaks away, in units of `grip.noise`; chosen."""
_RANGE = math.log(LOAD_RANGE_N[1] / LOAD_RANGE_N[0])
"""Width of the range of loads, natural logarithm."""
_OUTLIER = 0.002
"""Density of a load that no hypothesis explains, so that one wrong frame excludes nothing; chosen."""
_STOPPING = 0.1
"""Weight of slides of objects that friction would carry: those that are about to stop; chosen."""


def _normal(x: Floats, std: float) -> Floats:
    return np.asarray(np.exp(-0.5 * (x / std) ** 2) / (std * math.sqrt(2 * math.pi)))


def _chance_below(x: Floats, std: float) -> Floats:
    return _below(x / std)


def _below(z: Floats) -> Floats:
    """Return the normal distribution's probability below z, by the logistic that is nearest to it."""
    return np.asarray(1 / (1 + np.exp(np.clip(-1.702 * z, -60.0, 60.0))))
