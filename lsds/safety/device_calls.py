"""The thread in which a rig's devices are called, and how a call that does not return is noticed and left behind.

A call that hangs in a library cannot be ended from outside. So devices and algorithms are called in a thread of their
own, the cell's thread, while the thread that asked for it waits, looks at what is being called since when, and stays
free to be interrupted. Where a deadline passes it goes on without the cell's thread, which never gets another call.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from contextvars import copy_context
from dataclasses import dataclass, field
from functools import partial
from queue import SimpleQueue
from typing import Any, NamedTuple, TypeVar, cast
from weakref import finalize

from lsds.clock import WallClock, seconds
from lsds.errors import CallHangs, LsdsError, PluginError, raised_by

T = TypeVar("T")

#: Interval of looking at a call in progress, s; also what an interrupt may have to wait for on Windows.
CALL_LOOK_S = 0.05
#: Time that the cell's thread gets to finish after an interrupt (s).
INTERRUPT_SETTLE_S = 0.3
#: Names of the cell's thread, and of a thread that was left behind.
NAME, LEFT = "lsds-cell", "lsds-left-behind"


class Call(NamedTuple):
    """A call that may hang: of whom, its name, its limit (s of real time), and the config key of that limit."""

    who: str
    name: str
    limit_s: float
    key: str = ""


class Calls:
    """The call in progress in the cell's thread. A mark costs 0.15 microseconds."""

    __slots__ = ("at", "count")

    def __init__(self) -> None:
        self.at: Call | None = None
        self.count = 0

    def make(self, call: Call, function: Callable[..., T], *arguments: object) -> T:
        """Call a function with its deadline marked; the waiting thread raises CallHangs if the deadline passes.

        Raises PluginError instead of a SystemExit, which would end the program that runs the cell.
        """
        before, self.at = self.at, call
        self.count += 1
        try:
            return function(*arguments)
        except SystemExit as error:
            ended = PluginError(f"{call.who} ended the program in {call.name}(): sys.exit({error.code})")
            _mark(ended, call)
            raise ended from error
        except BaseException as error:
            # A job's call holds those of its devices: the innermost marks the error first.
            _mark(error, call)
            raise
        finally:
            self.at = before
            self.count += 1

    def named(self, call: Call, function: Callable[..., T], *arguments: object, where: str = "") -> T:
        """Make a call of a backend. Raises PluginError, naming it, for an exception that does not explain itself."""
        try:
            return self.make(call, function, *arguments)
        except LsdsError:
            raise
        except Exception as error:
            raise raised_by(call.who, error, where) from error

    def expect(self, kind: type[T], call: Call, function: Callable[..., T], *arguments: object) -> T:
        """Make a call. Raises PluginError for an answer that is not of this type."""
        answer = self.make(call, function, *arguments)
        if not isinstance(answer, kind):
            got = type(answer).__name__
            raise PluginError(
                f"{call.who}: {call.name}() returned {got}, not {kind.__name__} (a mistake in that plugin)"
            )
        return answer


def call_of(error: BaseException) -> Call | None:
    """Return the innermost marked call that raised an error, None for one that no such call raised."""
    return getattr(error, _MARK, None)


def _mark(error: BaseException, call: Call) -> None:
    if call_of(error) is None:
        with suppress(AttributeError, TypeError):  # An exception of a library may take no attributes.
            setattr(error, _MARK, call)


_MARK = "_lsds_call"
"""Attribute of an error: the call that raised it."""


@dataclass(slots=True)
class _Task:
    function: Callable[[], Any]
    done: threading.Event = field(default_factory=threading.Event)
    result: Any = None
    error: BaseException | None = None

    def outcome(self) -> Any:
        """Return the result or raise the error, once: an error holds the frames of a run by its traceback."""
        error, self.error = self.error, None
        try:
            if error is not None:
                raise error
            return self.result
        finally:
            del error


class CellThread:
    """Runs functions one after another in one thread, while the caller waits. Functions mark their calls in `calls`.

    A function that asks for another one has it run at once, in the same thread.
    """

    def __init__(self) -> None:
        self.calls = Calls()
        self._tasks: SimpleQueue[_Task | None] = SimpleQueue()
        self._thread: threading.Thread | None = None
        # The thread refers to this mark only, so that an unclosed rig can be collected, which ends the thread.
        self._mark = object()
        self._busy: _Task | None = None

    def run(self, function: Callable[[], T], *, leave: Callable[[], object] = lambda: None) -> T:
        """Run a function in the cell's thread and return its result, or raise its error.

        Raises CallHangs if a marked call passes its deadline. If the wait ends before the function does, `leave` is
        called to ask the function to end; after an interrupt it gets `INTERRUPT_SETTLE_S` for that.
        """
        if self._inside:
            return function()
        if self._busy is not None:
            self._forget()  # Another function is still running: this one must not wait for it.
        task = _Task(partial(copy_context().run, function))
        self._busy = task
        self._start()
        self._tasks.put(task)
        try:
            _attend(task, self.calls)
        except BaseException as error:
            leave()
            if isinstance(error, CallHangs) or not task.done.wait(INTERRUPT_SETTLE_S):
                self._forget()
            raise
        finally:
            if self._busy is task:
                self._busy = None
        return cast("T", task.outcome())

    def call(self, call: Call, function: Callable[[], T]) -> T:
        """Make one marked call in the cell's thread. Raises CallHangs where it passes its deadline."""
        return self.run(lambda: self.calls.make(call, function))

    def end(self) -> None:
        """End the thread, if there is one and it is idle; the next function gets a new one."""
        if self._thread is not None and self._busy is None and not self._inside:
            self._tasks.put(None)
            self._thread.join(INTERRUPT_SETTLE_S)
            self._thread = None

    @property
    def _inside(self) -> bool:
        return getattr(_HERE, "mark", None) is self._mark

    def _start(self) -> None:
        if self._thread is None:
            self._tasks = SimpleQueue()
            self._thread = threading.Thread(target=_work, args=(self._mark, self._tasks), name=NAME, daemon=True)
            self._thread.start()
            finalize(self, self._tasks.put, None).atexit = False

    def _forget(self) -> None:
        """Leave the thread to itself: it gets nothing more to do, and ends when its call returns."""
        self.calls = Calls()
        if self._thread is not None:
            self._thread.name = LEFT
            self._tasks.put(None)
        self._thread, self._busy = None, None


_HERE = threading.local()


def _work(mark: object, tasks: SimpleQueue[_Task | None]) -> None:
    _HERE.mark = mark
    while (task := tasks.get()) is not None:
        try:
            task.result = task.function()
        except BaseException as error:
            task.error = error
        task.done.set()
        del task  # A task refers to a whole run, which must not stay in memory until the next task.


def _attend(task: _Task, calls: Calls) -> None:
    """Wait for a task's end. Raises CallHangs if a call passes its deadline."""
    if task.done.wait(CALL_LOOK_S):
        return
    clock = WallClock()
    count, waited_s, looked_ns = -1, 0.0, clock.now()
    while not task.done.wait(CALL_LOOK_S):
        now_ns = clock.now()
        # If this process was stopped, or not scheduled, so was the call: that time does not count.
        passed_s, looked_ns = min(seconds(now_ns - looked_ns), 2 * CALL_LOOK_S), now_ns
        call = calls.at
        if call is None or calls.count != count:
            count, waited_s = calls.count, 0.0
            continue
        waited_s += passed_s
        if waited_s > call.limit_s:
            raise CallHangs(call.who, call.name, call.limit_s, key=call.key)
