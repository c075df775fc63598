"""Checks of the traces of a fault: it is seeded, keeps its state to itself, and modifies nothing."""

from __future__ import annotations

from collections import deque
from functools import partial
from typing import Any

from lsds.testing.afflicting import ALGORITHMS, Afflicted, first_difference, log_difference
from lsds.testing.bench import Bench
from lsds.testing.exact import arrays_of
from lsds.testing.outcomes import NotApplicable
from lsds.testing.process_state import changes_by, global_seed


def check_fault_is_deterministic(bench: Bench) -> None:
    """Two builds with one seed give the same answers to the same calls, whatever the global random state is."""
    runs, parts = [], []
    for seed in (1, 2):
        with global_seed(seed):
            afflicted = Afflicted(bench, middle=True)
            runs.append(list(afflicted.outcomes()))
        parts.append(afflicted.part)
    difference = first_difference(*runs) or log_difference(*parts)
    assert not difference, (
        f"two builds with the same seed differ: {difference}; use numpy.random.default_rng with "
        "context.rng_seed(...), and context.clock for times"
    )


def check_builds_share_nothing(bench: Bench) -> None:
    """Two builds that run in turn answer as one does alone."""
    alone = list(Afflicted(bench, middle=True).outcomes())
    pair = (Afflicted(bench, middle=True), Afflicted(bench, middle=True))
    together = list(zip(*(afflicted.outcomes() for afflicted in pair), strict=True))
    for one in zip(*together, strict=True):
        difference = first_difference(list(one), alone)
        assert not difference, (
            f"a build answers differently next to another one: {difference}; keep state in what around() returns, not "
            "in the class or the module"
        )


def check_leaves_the_values_of_others(bench: Bench) -> None:
    """No array that the part has returned, or that the caller has passed, is modified."""
    afflicted = Afflicted(bench)
    kept = _Kept()
    name = "read" if hasattr(afflicted.part, "read") else "update"
    if hasattr(afflicted.part, name):
        original = getattr(afflicted.part, name)
        setattr(afflicted.part, name, lambda *given: kept.note("the part's answer", original(*given)))
    for outcome in afflicted.outcomes(noted=partial(kept.note, "its input")):
        if isinstance(outcome.value, ValueError) and "read-only" in str(outcome.value):
            raise AssertionError(f"{outcome.where}: {outcome.value}; work on a copy of the array")
        changed = kept.changed()
        assert not changed, (
            f"{outcome.where}: the fault modified {changed}; work on a copy, others hold the same arrays"
        )


def check_fault_leaves_global_state(bench: Bench) -> None:
    """Global random generators, error state, logging, working folder, environment and threads stay as they are."""

    def live() -> None:
        afflicted = Afflicted(bench)
        list(afflicted.outcomes())
        if afflicted.target in ALGORITHMS:
            afflicted.clear()

    changes = changes_by(live)
    assert not changes.state, (
        f"the fault changed {', '.join(changes.state)}; draw from numpy.random.default_rng(context.rng_seed(...)), "
        "use `with numpy.errstate(...)` and logging.getLogger(__name__), and leave the process as it is"
    )
    assert not changes.threads, (
        f"the fault started {', '.join(map(str, changes.threads))}; answer in the caller's thread"
    )


def check_reset_forgets(bench: Bench) -> None:
    """After `reset` (`begin` of a job) an algorithm with the fault answers like a new build."""
    used, fresh = Afflicted(bench, middle=True), Afflicted(bench, middle=True)
    if used.target not in ALGORITHMS:
        raise NotApplicable(f"a part of the kind {used.target} has no reset")
    list(used.outcomes())
    used.clear()
    fresh.age(used.clock.now())
    difference = first_difference(list(used.outcomes()), list(fresh.outcomes()))
    assert not difference, (
        f"after a reset the {used.target} with the fault, against a new one, gives {difference}; clear in reset() what "
        "update() has kept, seed random numbers again, and pass the call on"
    )


class _Kept:
    """Arrays with their content when they were noted; keeps only the last ones, which a fault may hold."""

    def __init__(self) -> None:
        self._noted: deque[tuple[str, Any, bytes]] = deque(maxlen=40)

    def note(self, whose: str, value: Any) -> Any:
        """Note the arrays of a value, and return it."""
        self._noted.extend((f"{name} of {whose}", array, array.tobytes()) for name, array in arrays_of(value).items())
        return value

    def changed(self) -> str:
        """Return which arrays have changed, "" if none has."""
        return ", ".join(dict.fromkeys(name for name, array, was in self._noted if array.tobytes() != was))


FAULT_TRACE_CHECKS = (
    check_fault_is_deterministic,
    check_builds_share_nothing,
    check_leaves_the_values_of_others,
    check_fault_leaves_global_state,
    check_reset_forgets,
)
