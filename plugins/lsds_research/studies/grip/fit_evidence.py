"""Fit the weights of the evidence of a slide: `python -m lsds_research.studies.grip.fit_evidence` (some 30 minutes).

Lifts of development objects are recorded: random ones, half of them on worn, noisy gels at other frame rates, and those
of the catalogue under changes of the load. The belief is then fed with the recorded rounds again, and the weights are
those with which its probability of a slide fits the true slip best (least log loss). The objects are divided in two;
weights fitted on each half are tried on the other, next to the present ones and to the rate of slides alone. Frames
between rest and slip, slides after their first 0.8 s, and lost objects do not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from lsds.cli.threads import one_thread, processes
from lsds.clock import nanoseconds
from lsds.contracts import Detection, GripEstimate, SlipEstimate
from lsds.grip.belief import GripBelief
from lsds.grip.evidence import CLOSING_WEIGHTS, STILL_WEIGHTS, Evidence, SlipEvidence
from lsds.grip.observer import GripObserver
from lsds.session.run import run
from lsds.support.processes import spread
from lsds_research.collecting.objects import PLANS
from lsds_research.studies.grip.lift import OFF, Lift, weight_n
from lsds_research.studies.grip.random_objects import drawn

Floats = NDArray[np.float64]

DRAWS = ((1001, 12), (1002, 12), (1009, 8), (0, 10))
"""Development draws of random objects, and how many objects of each."""
CHANGED = ("shove", "wet", "brisk", "turn")
"""Changes of the load under which the catalogue is lifted, two for each object."""
SLIDES_M_S = 2e-3
"""Minimum true speed of a slide, m/s; chosen."""
RESTS_M_S = 5e-4
"""Maximum true speed at rest, m/s; chosen."""
BEGINS_S = 0.8
"""Time from the beginning of a slide in which its frames count, s: a lost object must not outweigh the others."""
FRAME_NS = nanoseconds(0.04)
"""Time before a frame over which the true speed is averaged, ns."""
EVALUATIONS = 110
"""Number of weights that a search tries (Nelder and Mead 1965); chosen."""
LEAST_PROBABILITY = 1e-3
"""Minimum probability of what happened in the log loss; chosen."""


EVIDENCE_AT = {"update": 3, "weigh": 0}
"""Methods of the belief that take evidence, with the place of the evidence among their arguments."""


class Round(NamedTuple):
    """A call of the belief's method `name`, and the answers of detector and estimator that its evidence is of."""

    name: str
    t_ns: int
    arguments: tuple[Any, ...]
    options: dict[str, Any]
    seen: tuple[Detection, SlipEstimate, float] | None = None


class Recorded(NamedTuple):
    """The object of a lift, the belief's rounds (the first makes it), and the true slip speed (n, 2) over time."""

    name: str
    rounds: list[Round]
    truth: Floats


@contextmanager
def recording(rounds: list[Round]) -> Iterator[None]:
    """Record the calls of the belief in this process, from its making on."""
    t_ns, seen = 0, None

    def believe(self: GripObserver, frame: GripEstimate, *more: Any) -> dict[str, Any]:
        nonlocal t_ns
        t_ns = frame.t_ns
        return was_believe(self, frame, *more)

    def take(self: SlipEvidence, *answers: Any) -> Evidence:
        nonlocal seen
        seen = answers
        return was_take(self, *answers)

    def noted(name: str) -> Callable[..., None]:
        was = getattr(GripBelief, name)

        def call(self: GripBelief, *arguments: Any, **options: Any) -> None:
            rounds.append(Round(name, t_ns, arguments, options, seen if name in EVIDENCE_AT else None))
            was(self, *arguments, **options)

        return call

    was_believe, was_take = GripObserver._believe, SlipEvidence.take
    with ExitStack() as patches:
        patches.enter_context(patch.object(GripObserver, "_believe", believe))
        patches.enter_context(patch.object(SlipEvidence, "take", take))
        for name in ("__init__", "reset", "know_normal", *EVIDENCE_AT):
            patches.enter_context(patch.object(GripBelief, name, noted(name)))
        yield


def recorded(lift: tuple[str, Sequence[str]]) -> Recorded:
    """Run a lift (its object, config keys) and record it."""
    name, overrides = lift
    rounds: list[Round] = []
    with recording(rounds):
        session = run(None, overrides)
    truth = np.array([(each.t_ns, math.hypot(*each.slip_velocity_m_s)) for each in session.truths if not each.dropped])
    return Recorded(name, rounds, truth)


def lifts() -> Iterator[tuple[str, list[str]]]:
    """Yield the development lifts: object and config keys."""
    rng = np.random.default_rng(3)
    for draw, count in DRAWS:
        for index in range(count):
            each = drawn(draw, index)
            rig = _worn(rng) if index % 2 else []
            yield each.name, [*each.lift("belief", each.squeeze_mm).overrides(), *rig]
            if index % 3 == 0:
                # Half of the squeeze without a controller: a slide that goes on.
                slides = each.lift(OFF, 0.5 * each.squeeze_mm)
                yield each.name, [*slides.overrides(), *rig, "task.lift_s=1.0"]
    for number, name in enumerate(PLANS):
        for at, change in enumerate(CHANGED):
            if (number + at) % 2 == 0:
                squeeze_mm, seed = 1.1 + 0.3 * (number % 3), 400 + number
                yield name, Lift("belief", name, squeeze_mm, 0.038, 1.0, change, seed, weight_n(name)).overrides()


def _worn(rng: np.random.Generator) -> list[str]:
    sensor = "sensor.mock-gelsight-mini"
    noise, wear, rate = rng.uniform(0.5, 2.5), rng.uniform(0, 1), rng.uniform(15, 30)
    return [f"{sensor}.noise={noise:.2f}", f"{sensor}.wear={wear:.2f}", f"{sensor}.rate_hz={rate:.1f}"]


def slid(lift: Recorded) -> dict[int, bool]:
    """Return whether the object slid, by the time (ns) of each round that counts."""
    t_ns, speeds = lift.truth.T
    sums = np.concatenate([[0.0], np.cumsum(speeds)])
    found: dict[int, bool] = {}
    began_ns: int | None = None
    for each in lift.rounds:
        first, end = np.searchsorted(t_ns, (each.t_ns - FRAME_NS, each.t_ns), side="right")
        if each.seen is None or end <= first:
            continue
        speed = (sums[end] - sums[first]) / (end - first)
        if speed < SLIDES_M_S:
            began_ns = None
            if speed < RESTS_M_S:
                found[each.t_ns] = False
            continue
        began_ns = each.t_ns if began_ns is None else began_ns
        if each.t_ns - began_ns <= nanoseconds(BEGINS_S):
            found[each.t_ns] = True
    return found


def log_loss(lifts: Sequence[tuple[Recorded, dict[int, bool]]], weights: Floats) -> float:
    """Return the mean log loss of the belief's probability of a slide with the weights (6,) of the evidence."""
    still, closing = ((float(a), float(b), float(c)) for a, b, c in (weights[:3], weights[3:]))
    losses: list[float] = []
    for lift, labels in lifts:
        made, *rounds = lift.rounds
        belief = GripBelief(*made.arguments, compiled=True)
        _, answer_s = made.arguments
        evidence = SlipEvidence(answer_s, still, closing)
        for each in rounds:
            if each.name == "reset":
                evidence = SlipEvidence(answer_s, still, closing)
            arguments = list(each.arguments)
            if each.seen is not None:
                arguments[EVIDENCE_AT[each.name]] = evidence.take(*each.seen)
            getattr(belief, each.name)(*arguments, **each.options)
            if each.seen is None:
                continue
            if each.t_ns in labels:
                right = belief.slips if labels[each.t_ns] else 1 - belief.slips
                losses.append(-math.log(max(right, LEAST_PROBABILITY)))
    return float(np.mean(losses))


def fitted(lifts: Sequence[tuple[Recorded, dict[int, bool]]]) -> Floats:
    """Return the weights (6,) with the least log loss; slopes are not negative."""
    from scipy.optimize import minimize

    def loss(weights: Floats) -> float:
        return math.inf if min(*weights[1:3], *weights[4:6]) < 0 else log_loss(lifts, weights)

    begin = np.array([*STILL_WEIGHTS, *CLOSING_WEIGHTS])
    simplex = np.vstack([begin, begin + np.diag(0.2 * np.maximum(np.abs(begin), 0.4))])
    found = minimize(loss, begin, method="Nelder-Mead", options={"initial_simplex": simplex, "maxfev": EVALUATIONS})
    return np.asarray(found.x)


def main() -> None:
    """Record, fit, and print what was found."""
    one_thread()
    kept = [lift for _, lift in spread(recorded, list(lifts()), processes()) if isinstance(lift, Recorded)]
    labelled = [(lift, slid(lift)) for lift in kept]
    names = sorted({lift.name for lift in kept})
    halves = [[each for each in labelled if (names.index(each[0].name) % 2 == 0) is even] for even in (True, False)]
    present = np.array([*STILL_WEIGHTS, *CLOSING_WEIGHTS])
    for own, other in ((halves[0], halves[1]), (halves[1], halves[0])):
        found = fitted(own)
        _report(f"fitted on {len(own)} lifts, tried on {len(other)} of other objects", found, log_loss(other, found))
        _report("  present weights", present, log_loss(other, present))
        print(f"  rate of slides alone: log loss {_of_rate(labels for _, labels in other):.4f}")
    found = fitted(labelled)
    _report(f"fitted on all {len(labelled)} lifts", found, log_loss(labelled, found))


def _report(what: str, weights: Floats, loss: float) -> None:
    still, closing = (", ".join(f"{weight:.2f}" for weight in half) for half in (weights[:3], weights[3:]))
    print(f"{what}: still ({still}), closing ({closing}), log loss {loss:.4f} (simulated)", flush=True)


def _of_rate(labels: Iterable[dict[int, bool]]) -> float:
    rate = float(np.mean([value for each in labels for value in each.values()]))
    return -rate * math.log(rate) - (1 - rate) * math.log(1 - rate)


if __name__ == "__main__":
    main()
