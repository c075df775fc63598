"""The calls that the kit makes to a part with a fault: known inputs, by the target of the fault."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

from lsds.contracts import ArmCommand, Cycle, GripperCommand, Twist
from lsds.contracts.fault import OBSERVER
from lsds.contracts.values import ABSTAINED
from lsds.testing.grips import ABSTAINS, grip_inputs
from lsds.testing.known_devices import SAMPLE_NS
from lsds.testing.situations import situations
from lsds.testing.stimulus import FRAME_NS, cycles, frames, observations

Step = Callable[[Any], Any]
STAGE = "lift"
"""Stage with which the kit lets a fault begin that has an option `at`."""
LONG_NS = 2_000_000_000
"""Length of a course."""


def course(target: str) -> Iterator[tuple[int, str, Step]]:
    """Yield the calls of a course: time (ns), name, and the call."""
    yield from _COURSES[target]()


def _read(device: Any) -> Any:
    return device.read()


def _reads(step_ns: int = SAMPLE_NS) -> Iterator[tuple[int, str, Step]]:
    for t_ns in range(step_ns, LONG_NS, step_ns):
        yield t_ns, "read()", _read


def _gripper() -> Iterator[tuple[int, str, Step]]:
    for i, (t_ns, name, step) in enumerate(_reads()):
        yield t_ns, name, step
        if i % 10 == 9:
            command = GripperCommand(0.0285 + 1e-4 * (i % 7), 0.05, 60.0, t_ns + FRAME_NS)
            yield t_ns, "command()", partial(_command, command)


def _arm() -> Iterator[tuple[int, str, Step]]:
    for i, (t_ns, name, step) in enumerate(_reads()):
        yield t_ns, name, step
        if i % 5 == 4:
            command = ArmCommand(Twist((0.0, 0.0, 0.02 + 1e-4 * i)), 0.5, t_ns + FRAME_NS)
            yield t_ns, "command()", partial(_command, command)


def _command(command: Any, device: Any) -> Any:
    return device.command(command)


def _updates(inputs: Iterable[tuple[Any, ...]]) -> Iterator[tuple[int, str, Step]]:
    """Yield calls of `update` with the arguments of each input, again and again."""
    for i, arguments in enumerate(itertools.islice(itertools.cycle(inputs), LONG_NS // FRAME_NS - 1), start=1):
        yield i * FRAME_NS, "update()", partial(_update, *arguments)


def _update(*given: Any) -> Any:
    *arguments, algorithm = given
    return algorithm.update(*arguments)


def _job() -> Iterator[tuple[int, str, Step]]:
    for now in situations(0.05)[1:]:
        if now.t_ns < LONG_NS:
            yield now.t_ns, "step()", partial(_step, now)


def _step(now: Any, job: Any) -> Any:
    return job.step(now)


def _cell() -> Iterator[tuple[int, str, Step]]:
    for t_ns in range(SAMPLE_NS, LONG_NS, SAMPLE_NS):
        yield t_ns, "advance()", partial(_advance, t_ns)
        yield t_ns, "truth()", _truth


def _advance(t_ns: int, cell: Any) -> Any:
    return cell.advance(t_ns)


def _truth(cell: Any) -> Any:
    return cell.truth()


def _observer() -> Iterator[tuple[int, str, Step]]:
    seen = cycles("slides")
    for i in range(LONG_NS // FRAME_NS - 1):
        t_ns = (i + 1) * FRAME_NS
        cycle = Cycle(t_ns, STAGE, False, (seen[i % len(seen)],), ABSTAINS, ABSTAINED, None, 0.03, 0.03)
        yield t_ns, "observer()", partial(_call, cycle)


def _call(cycle: Any, observer: Any) -> Any:
    return observer(cycle)


_COURSES: dict[str, Callable[[], Iterator[tuple[int, str, Step]]]] = {
    "cell": _cell,
    "sensor": lambda: _reads(FRAME_NS // 2),
    "gripper": _gripper,
    "arm": _arm,
    "pose_source": _reads,
    "tracker": lambda: _updates(zip(frames("slides"))),
    "detector": lambda: _updates(zip(observations("slides"))),
    "estimator": lambda: _updates(zip(observations("slides"))),
    "controller": lambda: _updates(grip_inputs("slides")),
    "job": _job,
    OBSERVER: _observer,
}
