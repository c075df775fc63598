"""The course of a trial: what client and mock do before, during and after the fault, and what each answered."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, field
from typing import Any

from lsds.clock import NS_PER_S, WallClock, nanoseconds
from lsds.errors import DeviceError
from lsds.testing.mock_handle import MockHandle, Truth
from lsds.testing.torture.cases import Case, Possible, code_of
from lsds.testing.torture.driven import Call, DrivenClient

CLOCK = WallClock()
CLIENT_CONNECT_S = 20.0
"""Time within which a client has to connect on a healthy line (s)."""
BEFORE_S = 0.3
"""Duration of the healthy line while the device moves (s); chosen."""
FAULT_S = 0.8
"""Duration of the fault (s); chosen."""
AFTER_S = 4.0
"""Maximum wait for right answers after the fault (s); chosen."""
RIGHT = 5
"""Number of right answers in a row after which the client has recovered."""
PERIOD_S = {"gripper": 0.02, "arm": 0.05, "sensor": 0.0}
"""Pause between two answers (s). A camera sets its own pace."""
START_M = 0.040
"""Aperture at which a gripper's course begins (m)."""
CLOSED_M = 0.0
"""Aperture that is commanded next (m); an object of `OBJECT_MM` is in the way."""
REOPENED_M = 0.035
"""Aperture to which the course opens the fingers on purpose at the end (m)."""
OBJECT_MM = 20
"""Width of the object between the fingers, mm."""
SLOW_DRIVE_M_S = 0.02
"""Speed of closing, slow enough for the fault to happen during it (m/s)."""
FAST_DRIVE_M_S = 0.10
"""Speed of opening (m/s)."""
ARRIVED_M = 1.5e-3
"""Maximum distance of fingers that have followed a command from its aperture (m); chosen."""
ARRIVES_S = 4.0
"""Time within which fingers have to follow a command on a healthy line (s)."""
RISES_M_S = 0.02
"""Speed at which an arm rises (m/s); chosen."""
ADJUSTS_S = 2.0
"""Time in which a camera adjusts its exposure (s)."""
STOPS_S = 0.5
"""An arm may move for so long after `stop`, or after its client has ended (s)."""


@dataclass
class Course:
    """Record of a trial. Times are monotonic, ns; `broken` is why a trial could not begin, "" if it did.

    `moved_from_ns` is when the device was first commanded, `fault_ns` when the fault began and ended, `ends_ns` the end
    of the period in which the device must not open or go on.
    """

    case: Case
    calls: list[Call] = field(default_factory=list)
    truths: list[Truth] = field(default_factory=list)
    transport: str = ""
    broken: str = ""
    moved_from_ns: int = 0
    fault_ns: tuple[int, int] = (0, 0)
    ends_ns: int = 0
    followed: bool | None = None
    moves_on: bool = False
    reference: Any = None

    @property
    def last_error(self) -> str:
        """The error of the last call that had one."""
        return next((call.error for call in reversed(self.calls) if call.error), "")


class _Trial:
    """A mock and a client during one course."""

    def __init__(self, course: Course, mock: MockHandle, client: DrivenClient, hang_s: float) -> None:
        self.course, self.mock, self.client, self.hang_s = course, mock, client, hang_s

    def call(self, name: str, *args: Any, limit_s: float | None = None) -> Call:
        made = self.client.call(name, *args, limit_s=limit_s or self.hang_s)
        self.course.calls.append(made)
        return made

    @property
    def alive(self) -> bool:
        """Whether the client runs; notes its death if it has died between two calls."""
        death = self.client.death()
        if death is not None:
            self.course.calls.append(death)
        return self.client.alive

    def poll(self, lasts_s: float, *, each: Callable[[], object] = lambda: None) -> None:
        """Read for a time; ends early with the client."""
        end_ns = CLOCK.now() + nanoseconds(lasts_s)
        while self.alive and CLOCK.now() < end_ns:
            each()
            if self.alive:
                self.call("read")
            self.pause()

    def pause(self) -> None:
        if pause_s := PERIOD_S[self.course.case.kind]:
            CLOCK.sleep_until(CLOCK.now() + nanoseconds(pause_s))

    def recovers(self, right: Callable[[Course, Call], bool], *, each: Callable[[], object] = lambda: None) -> None:
        """Read until the answers are right again, for at most `AFTER_S`."""
        end_ns, count = CLOCK.now() + nanoseconds(AFTER_S), 0
        while self.alive and CLOCK.now() < end_ns and count < RIGHT:
            each()
            count = count + 1 if self.alive and self._is_right(right, self.call("read")) else 0
            self.pause()

    def _is_right(self, right: Callable[[Course, Call], bool], call: Call) -> bool:
        self.course.truths = self.mock.truths(call.began_ns - NS_PER_S)
        return right(self.course, call)

    def wait(self, done: Callable[[Truth], bool], lasts_s: float) -> bool:
        """Wait until the plant is in a state; return whether it came to be."""
        end_ns = CLOCK.now() + nanoseconds(lasts_s)
        while not (reached := done(self.mock.truth)) and CLOCK.now() < end_ns:
            CLOCK.sleep_until(CLOCK.now() + nanoseconds(0.02))
        return reached

    def during(self, fault: Possible | None, course: Callable[[], object]) -> None:
        """Run a part of the course with the fault."""
        case = self.course.case
        begin: Any = nullcontext()
        if fault is not None:
            place = {"face": fault.face} if fault.face else {}
            begin = self.mock.fault(fault.kind, severity=case.severity, **code_of(fault.kind), **place)
        began_ns = CLOCK.now()
        with begin:
            course()
        self.course.fault_ns = (began_ns, CLOCK.now())

    def observe(self) -> None:
        """Add what the plant has done since the device was first commanded."""
        self.course.truths = self.mock.truths(self.course.moved_from_ns - nanoseconds(1.0))


def run_course(
    course: Course,
    mock: MockHandle,
    client: DrivenClient,
    fault: Possible | None,
    right: Callable[[Course, Call], bool],
    hang_s: float,
) -> Course:
    """Run the course of the case's kind; `right` decides whether an answer is right. Raises DeviceError for a mock that
    does not answer."""
    trial = _Trial(course, mock, client, hang_s)
    connected = trial.call("connect", mock.address, limit_s=CLIENT_CONNECT_S)
    if connected.error or connected.ending:
        course.broken = f"it does not connect to {mock.address}: {connected.error or connected.ending}"
        return course
    {"gripper": _gripper, "arm": _arm, "sensor": _camera}[course.case.kind](trial, fault, right)
    trial.observe()
    return course


def _first_read(trial: _Trial) -> bool:
    """Read once on the healthy line; return whether that works, and note why not."""
    first = trial.call("read")
    if first.error or first.ending or first.value is None:
        trial.course.broken = f"read() on a healthy line: {first.error or first.ending or 'returned None'}"
        return False
    return True


def _gripper(trial: _Trial, fault: Possible | None, right: Callable[[Course, Call], bool]) -> None:
    course = trial.course
    sent = trial.call("move", START_M, FAST_DRIVE_M_S)
    if sent.error or sent.ending:
        course.broken = f"move() on a healthy line: {sent.error or sent.ending}"
        return
    if not trial.wait(lambda truth: abs(truth.aperture_m - START_M) < ARRIVED_M and not truth.moving, ARRIVES_S):
        course.broken = (
            f"move({START_M}, {FAST_DRIVE_M_S}) leaves the fingers at {trial.mock.truth.aperture_m * 1e3:.1f} mm"
        )
        return
    if not _first_read(trial):
        return
    course.moved_from_ns = CLOCK.now()

    def close_again() -> None:
        trial.poll(FAULT_S / 2)
        if trial.alive:
            trial.call("move", CLOSED_M, SLOW_DRIVE_M_S)
        trial.poll(FAULT_S / 2)

    trial.call("move", CLOSED_M, SLOW_DRIVE_M_S)
    trial.poll(BEFORE_S)
    trial.during(fault, close_again)
    trial.recovers(right)
    course.ends_ns = CLOCK.now()
    if not trial.alive:
        return
    sent = trial.call("move", REOPENED_M, FAST_DRIVE_M_S)
    if not (sent.error or sent.ending):
        course.followed = trial.wait(lambda truth: abs(truth.aperture_m - REOPENED_M) < ARRIVED_M, ARRIVES_S)


def _arm(trial: _Trial, fault: Possible | None, right: Callable[[Course, Call], bool]) -> None:
    course = trial.course
    if not _first_read(trial):
        return
    course.moved_from_ns = CLOCK.now()

    def rise() -> None:
        trial.call("move", RISES_M_S)

    trial.poll(BEFORE_S, each=rise)
    trial.during(fault, lambda: trial.poll(FAULT_S, each=rise))
    trial.recovers(right, each=rise)
    stopped = trial.call("stop") if trial.alive else None
    stopped_ns = CLOCK.now()
    # An error is a proper answer to `stop`: the caller then knows that the arm may still move.
    if stopped is None or not stopped.error:
        CLOCK.sleep_until(stopped_ns + nanoseconds(STOPS_S))
        course.moves_on = bool(trial.mock.truth.moving)
    course.ends_ns = CLOCK.now()


def _camera(trial: _Trial, fault: Possible | None, right: Callable[[Course, Call], bool]) -> None:
    course = trial.course
    if not _first_read(trial):
        return
    # A camera adjusts its exposure first: the reference is an image from when nothing changes any more.
    trial.poll(ADJUSTS_S)
    if trial.alive and not _first_read(trial):
        return
    course.reference = course.calls[-1].value
    course.moved_from_ns = CLOCK.now()
    trial.poll(BEFORE_S)
    trial.during(fault, lambda: trial.poll(FAULT_S))
    trial.recovers(right)
    course.ends_ns = CLOCK.now()


def started(case: Case, transport: str, options: dict[str, Any]) -> MockHandle:
    """Return the mock of a case, not yet started. Raises DeviceError for an unknown mock."""
    given = dict(options)
    if case.kind == "gripper":
        given = {"activated": True, "object_mm": OBJECT_MM, **given}
    given |= dict(case.settings)
    try:
        return MockHandle(case.mock, transport=transport or None, seed=case.seed, options=given)
    except ValueError as error:
        raise DeviceError(f"mock {case.mock}", str(error)) from error
