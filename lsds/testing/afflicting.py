"""Runs a fault around a known part with known inputs, before and after the moment when it begins."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from lsds.clock import VirtualClock, seconds
from lsds.contracts import BuildContext
from lsds.contracts.fault import OBSERVER
from lsds.contracts.stages import START, shared_stages
from lsds.testing.algorithms import writable
from lsds.testing.bench import Bench
from lsds.testing.exact import exact, shown
from lsds.testing.fault_courses import STAGE, course
from lsds.testing.gel import SPEC
from lsds.testing.known_algorithms import (
    KnownController,
    KnownDetector,
    KnownEstimator,
    KnownJob,
    KnownTracker,
)
from lsds.testing.known_devices import KnownArm, KnownCell, KnownGripper, KnownPoses, KnownSensor
from lsds.testing.situations import setting
from lsds.testing.stimulus import rest_frame

BEGINS_NS = 480_000_000
"""Time in a course at which the fault begins."""
WORST_SEVERITY = 5
"""Severity at which a random event may happen every time."""
MIDDLE_SEVERITY = 3
"""Severity at which the answers depend on the random numbers."""
SEED = 7
"""Seed of the kit; chosen."""
DEVICES = ("sensor", "gripper", "arm", "pose_source")
ALGORITHMS = ("tracker", "detector", "estimator", "controller", "job")
PARTS: dict[str, Callable[[VirtualClock], Any]] = {
    "cell": KnownCell,
    "sensor": KnownSensor,
    "gripper": KnownGripper,
    "arm": KnownArm,
    "pose_source": KnownPoses,
    "tracker": KnownTracker,
    "detector": KnownDetector,
    "estimator": KnownEstimator,
    "controller": KnownController,
    "job": KnownJob,
}
"""A part of each target but "observer", which has none."""


@dataclass
class Outcome:
    """The value or exception of one call, and an exact copy of it made at once."""

    where: str
    value: Any
    copy: Any


class Afflicted:
    """A fault around a new part, with its own clock and stages, ready to be run."""

    def __init__(
        self, bench: Bench, options: Mapping[str, Any] | None = None, *, bare: bool = False, middle: bool = False
    ) -> None:
        self.clock = VirtualClock()
        self.context = BuildContext(self.clock, SEED)
        self.fault = bench.host.build(
            "fault", bench.name, options_of(bench, options, MIDDLE_SEVERITY if middle else WORST_SEVERITY), self.context
        )
        self.target: str = self.fault.target
        require_target(self.target)
        self.part: Any = None if self.target == OBSERVER else PARTS[self.target](self.clock)
        self.whole: Any = self.fault.around(self.part)
        if bare:
            self.whole = _observe if self.part is None else self.part
        if self.target in DEVICES:
            self.whole.connect()
            self.whole.arm()
        elif self.target == "tracker":
            self.whole.start(rest_frame(), SPEC.pad)
        elif self.target == "job":
            self.whole.begin(setting())

    def begin(self) -> None:
        """Let the fault begin now."""
        shared_stages(self.context).enter(self.fault.moment, self.clock.now())

    def enter_others(self) -> None:
        """Enter stages with which the fault does not begin."""
        for stage in (START, "grasp"):
            if stage != self.fault.moment:
                shared_stages(self.context).enter(stage, self.clock.now())

    def clear(self) -> None:
        """Clear the state of an algorithm."""
        if self.target == "job":
            self.whole.begin(setting())
        else:
            self.whole.reset()

    def age(self, t_ns: int) -> None:
        """Advance the time of a course without calls; the fault begins in it."""
        self.enter_others()
        self.clock.sleep_until(BEGINS_NS)
        self.begin()
        self.clock.sleep_until(t_ns)

    def outcomes(self, *, begins: bool = True, noted: Callable[[Any], object] | None = None) -> Iterator[Outcome]:
        """Yield the outcome of each call of a course; the fault begins after `BEGINS_NS` if `begins`.

        With `noted`, calls get writable copies of the inputs; it is called with each copy first.
        """
        since_ns = self.clock.now()
        self.enter_others()
        for t_ns, name, step in course(self.target):
            self.clock.sleep_until(since_ns + t_ns)
            if begins and t_ns >= BEGINS_NS:
                self.begin()
            if noted is not None and isinstance(step, partial):
                copied = [writable(item) for item in step.args]
                for item in copied:
                    noted(item)
                step = partial(step.func, *copied)
            where = f"{name} at {seconds(t_ns):.3f} s"
            try:
                value = step(self.whole)
            except Exception as error:
                value = error
            yield Outcome(where, value, exact(value))


def options_of(bench: Bench, more: Mapping[str, Any] | None = None, severity: int = WORST_SEVERITY) -> dict[str, Any]:
    """Return the options of a fault, with `STAGE` as `at` and with `severity` if it has these options."""
    fields = fields_of(bench)
    kit = {name: value for name, value in (("at", STAGE), ("severity", severity)) if name in fields}
    return {**kit, **bench.options, **(more or {})}


def fields_of(bench: Bench) -> dict[str, Any]:
    """Return the fields of the options of a backend, none if it takes no options."""
    model = bench.host.options_model(bench.host.find(bench.kind, bench.name))
    return {} if model is None else dict(model.model_fields)


def require_target(target: Any) -> None:
    """Raise AssertionError for a target that is no part of a rig."""
    known = (*PARTS, OBSERVER)
    assert target in known, f"target is {target!r}, which is no part of a rig; use one of {', '.join(known)}"


def first_difference(ones: list[Outcome], others: list[Outcome]) -> str:
    """Return the first difference between the outcomes of two runs, "" for equal ones."""
    for one, other in zip(ones, others, strict=True):
        if one.copy != other.copy:
            return f"{one.where}: {shown(one.copy)} against {shown(other.copy)}"
    return ""


def log_difference(one: Any, other: Any) -> str:
    """Return the first difference between the calls that reached two parts, "" for equal ones."""
    if one is None or other is None:
        return ""
    for mine, theirs in zip(one.log, other.log, strict=False):
        if mine != theirs:
            return f"{shown(mine[2])} in {mine[1]} at {mine[0]:.3f} s against {shown(theirs[2])} in {theirs[1]}"
    if len(one.log) != len(other.log):
        return f"{len(one.log)} calls reached the part, against {len(other.log)}"
    return ""


def _observe(cycle: Any) -> None:
    """Observe nothing."""
