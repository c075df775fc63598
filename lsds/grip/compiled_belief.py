"""Compiled round of the belief about the grip: the arithmetic of `lsds.grip.belief` on each cell, in one pass."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from lsds.support.jit import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


@compiled
def advance(
    stick: Floats,
    slide: Floats,
    axes: tuple[Floats, Floats, Floats, Floats, Floats],
    jumps: float,
    breaks: tuple[float, float, float],
    stops: tuple[float, float, float],
    seen: tuple[float, float, float, float, float],
    floors: tuple[float, float],
    faint: bool,
) -> float:
    """Advance both hypotheses (loads, limits) by a round, in place; return how much began to slide.

    - `axes`: ln W (loads,), ln r (limits,), ln (W / r) of the diagonals, and the priors of load and limit.
    - `jumps`: share of the load, and of the limit, that is drawn from the prior again.
    - `breaks`: ln of the greatest load over squeeze^p before and now, and its scatter; no scatter, no new greatest.
    - `stops`: share that a sufficient friction stops in a round; ln of the squeeze^p / kappa, and its scatter. Without
      a scatter everything stops by that share.
    - `seen`: ln of the load, its scatter where the object hangs and where it slides, the share of objects that are
      being loaded, and the density of their load.
    - `floors`: density of an unexplained load, and weight of a slide that is about to stop.
    - `faint`: the load is less than the one that is given: probabilities take the place of densities.
    """
    ln_w, ln_r, ln_need, prior_w, prior_r = axes
    loads, limits = stick.shape
    by_w, by_r = np.zeros(loads), np.zeros(limits)
    for i in range(loads):
        row = stick[i]
        for j in range(limits):
            by_r[j] += row[j]
        for j in range(limits):
            by_w[i] += row[j]
    before, now, break_std = breaks
    hazard = np.zeros(limits)
    if break_std > 0:
        for j in range(limits):
            then = _below((before - ln_r[j]) / break_std)
            hazard[j] = min(max((_below((now - ln_r[j]) / break_std) - then) / max(1 - then, 1e-9), 0.0), 1.0)
    answer, ln_kinetic, stop_std = stops
    # In the opposite order of `ln_need`, so that a row of cells reads it forwards.
    stopped = np.full(len(ln_need), answer)
    if stop_std > 0:
        for k in range(len(ln_need)):
            stopped[k] *= _below((ln_kinetic - ln_need[len(ln_need) - 1 - k]) / stop_std)
    ln_f, noise, sliding_noise, loading, density = seen
    unexplained, stopping = floors
    hang, heavy, sliding = np.empty(loads), np.empty(loads), np.empty(limits)
    for i in range(loads):
        if faint:
            hang[i] = (1 - loading) * _below((ln_f - ln_w[i]) / noise) + loading + unexplained
        else:
            below = density if ln_w[i] > ln_f else 0.0
            hang[i] = (1 - loading) * _normal(ln_f - ln_w[i], noise) + loading * below + unexplained
        heavy[i] = stopping + (1 - stopping) * _below((ln_w[i] - ln_f) / sliding_noise)
    for j in range(limits):
        off = ln_f - ln_r[j] - ln_kinetic
        sliding[j] = (_below(off / sliding_noise) if faint else _normal(off, sliding_noise)) + unexplained
    begun, kept = 0.0, 1 - 2 * jumps
    for i in range(loads):
        row, other, own, mass = stick[i], slide[i], prior_w[i], by_w[i]
        share = stopped[loads - 1 - i : loads - 1 - i + limits]
        moved = 0.0
        for j in range(limits):
            sticks = row[j] * kept
            breaks_away = sticks * hazard[j]
            slides = other[j] + jumps * (own * by_r[j] + mass * prior_r[j]) + breaks_away
            back = slides * share[j]
            moved += breaks_away
            other[j] = (slides - back) * heavy[i] * sliding[j]
            row[j] = (sticks - breaks_away + back) * hang[i]
        begun += moved + 2 * jumps * mass
    return begun


@compiled
def walk(mass: Floats, share: float, along_limit: bool) -> None:
    """Spread the mass (loads, limits) in place to its neighbours along an axis, `share` to each; its edges keep it."""
    loads, limits = mass.shape
    if along_limit:
        for i in range(loads):
            row = mass[i]
            before = row[0]
            for j in range(limits):
                own = row[j]
                row[j] = (1 - 2 * share) * own + share * (before + (row[j + 1] if j < limits - 1 else own))
                before = own
        return
    before, own = mass[0].copy(), np.empty(limits)
    for i in range(loads):
        own[:] = mass[i]
        after = mass[i + 1] if i < loads - 1 else own
        row = mass[i]
        for j in range(limits):
            row[j] = (1 - 2 * share) * own[j] + share * (before[j] + after[j])
        before[:] = own


@compiled
def weigh(stick: Floats, slide: Floats, likelihood: float) -> float:
    """Weigh slide against stick, and make the sum of all 1 again, in place; return the probability of a slide."""
    sticks, slides = 0.0, 0.0
    for i in range(len(stick)):
        for j in range(stick.shape[1]):
            sticks += stick[i, j]
            slides += slide[i, j]
    total = sticks + likelihood * slides
    for i in range(len(stick)):
        for j in range(stick.shape[1]):
            stick[i, j] /= total
            slide[i, j] *= likelihood / total
    return likelihood * slides / total


@compiled
def limit_of(stick: Floats, slide: Floats, ln_r: Floats) -> tuple[float, float]:
    """Return mean and standard deviation of the logarithm of the friction limit."""
    by_r = np.zeros(len(ln_r))
    for i in range(len(stick)):
        for j in range(len(ln_r)):
            by_r[j] += stick[i, j] + slide[i, j]
    mean = variance = 0.0
    for j in range(len(ln_r)):
        mean += by_r[j] * ln_r[j]
    for j in range(len(ln_r)):
        variance += by_r[j] * (ln_r[j] - mean) ** 2
    return mean, math.sqrt(max(variance, 0.0))


@compiled
def need_of(stick: Floats, slide: Floats, cap: int, shift: int, risk: float) -> float:
    """Return the step of ln (W / r) that is exceeded with a probability of `risk`, between two steps linearly.

    Loads above `cap` count as `cap` if the object sticks. A sliding object needs `shift` steps more.
    """
    loads, limits = stick.shape
    last = loads + limits - 2
    # From the greatest need to the least, so that a row of cells adds to it forwards.
    mass = np.zeros(last + 1)
    for i in range(loads):
        row, other = stick[i], slide[i]
        into = mass[loads - 1 - min(i, cap) :]
        for j in range(limits):
            into[j] += row[j]
        begin = loads - 1 - i - shift
        # The greatest needs may be beyond the grid: they count as the greatest on it.
        beyond_grid = min(max(-begin, 0), limits)
        for j in range(beyond_grid):
            mass[0] += other[j]
        into, within = mass[max(begin, 0) :], other[beyond_grid:]
        for j in range(len(within)):
            into[j] += within[j]
    at, beyond = 0, mass[0]
    while at < last and beyond + mass[at + 1] <= risk:
        at += 1
        beyond += mass[at]
    upper = beyond + mass[at + 1] if at < last else 1.0
    return float(last - at - 1 + min((upper - risk) / max(upper - beyond, 1e-12), 1.0))


@compiled
def _below(z: float) -> float:
    return 1 / (1 + math.exp(min(max(-1.702 * z, -60.0), 60.0)))


@compiled
def _normal(x: float, std: float) -> float:
    return math.exp(-0.5 * (x / std) ** 2) / (std * math.sqrt(2 * math.pi))


@cache
def prepare() -> None:
    """Compile the functions, or load them from the cache, so that no round waits for it."""
    stick, slide = np.full((2, 3), 0.1), np.full((2, 3), 0.01)
    axes = (np.zeros(2), np.zeros(3), np.zeros(4), np.full(2, 0.5), np.full(3, 0.3))
    advance(stick, slide, axes, 0.0, (0.0, 0.0, 1.0), (0.5, 0.0, 1.0), (0.0, 0.1, 0.1, 0.5, 0.1), (0.1, 0.1), False)
    walk(stick, 0.1, False)
    need_of(stick, slide, 1, 0, 0.1)
    weigh(stick, slide, 1.0)
    limit_of(stick, slide, axes[1])
