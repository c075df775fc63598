"""A running program: each of its threads runs once per control cycle until it waits."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Generator, Mapping
from typing import Any

from lsds_mocks.wire.ur.script.compiler import MAIN, Compiled
from lsds_mocks.wire.ur.script.errors import Halt, ScriptError
from lsds_mocks.wire.ur.script.operations import Operations
from lsds_mocks.wire.ur.script.values import Pose, Struct, UrList
from lsds_mocks.wire.ur.script.work import THREAD, Work, exhausted

Waiting = Generator[None, None, Any]
"""A function that takes time: it yields once per control cycle."""

THREADS = 256
"""Maximum number of threads; a program that starts more is ended."""


_OPERATIONS = (
    *("add", "sub", "mul", "div", "mod", "neg", "eq", "ne", "lt", "le", "gt", "ge"),
    *("at", "put", "field", "put_field", "method", "copied"),
)


class Program:
    """One uploaded program. `step` runs it for one control cycle; `running` is true until it has ended.

    `functions` are the controller's functions by name; `work` is the budget per cycle; `at_end` is called once the
    program has ended for any reason. An error ends the program and is stored in `error`.
    """

    def __init__(
        self,
        compiled: Compiled,
        functions: Mapping[str, Callable[..., Any]],
        work: Work,
        at_end: Callable[[], None] = lambda: None,
    ) -> None:
        self.compiled = compiled
        self._at_end = at_end
        self._work = work
        self._stepping = False
        self.name = compiled.name
        self.secondary = compiled.secondary
        self.error: ScriptError | None = None
        self.paused = False
        self._threads: dict[int, Waiting] = {}
        self._handles = 0
        space: dict[str, Any] = {f"b_{name}": function for name, function in functions.items()}
        operations = self._operations = Operations(work)
        space |= {name: getattr(operations, name) for name in _OPERATIONS}
        space |= {
            "Pose": Pose,
            "UrList": UrList,
            "Struct": Struct,
            "run": self._run,
            "join": self._join,
            "kill": self._kill,
            "halt": _halt,
            "pause": self.pause,
            "work": work,
            "exhausted": exhausted,
        }
        self._space = space
        try:
            # This evaluates the defaults of the functions' parameters.
            for code in compiled.codes:
                exec(code, space)
            self._start(space[f"f_{MAIN}"]())
        except Exception as error:
            self.error = self._explained(error)
        self._main = self._handles

    @property
    def running(self) -> bool:
        """Whether the main thread is still running."""
        return self._main in self._threads

    def step(self) -> None:
        """Run every thread until it waits."""
        if self.paused:
            return
        done: set[int] = set()
        self._stepping = True
        # Threads that start meanwhile run in this cycle, too.
        while self.running and (waiting := [handle for handle in self._threads if handle not in done]):
            for handle in waiting:
                done.add(handle)
                thread = self._threads.get(handle)
                # A thread that pauses the program ends the cycle of the others.
                if thread is not None and not self.paused:
                    self._work.left -= THREAD
                    self._advance(handle, thread)
        self._stepping = False
        if not self.running:
            self._forget()

    def pause(self) -> None:
        """Suspend all threads until `resume`."""
        self.paused = True

    def resume(self) -> None:
        """Go on."""
        self.paused = False

    def stop(self) -> None:
        """End every thread now."""
        threads = list(self._threads.values())
        self._threads.clear()
        for thread in reversed(threads):
            _close(thread)
        self._at_end()
        if not self._stepping:
            self._forget()

    def fail(self, error: ScriptError) -> None:
        """End the program with an external error."""
        self.error = error
        self.stop()

    # -- inside -------------------------------------------------------------------------------------------

    def _forget(self) -> None:
        """Release all variables, because they and the functions reference each other."""
        self._space.clear()

    def _advance(self, handle: int, thread: Waiting) -> None:
        try:
            next(thread)
            if self._threads.get(handle) is not thread:
                thread.close()
        except StopIteration:
            self._threads.pop(handle, None)
        except Halt:
            self._threads.pop(handle, None)
            self.stop()
        except Exception as error:
            self._threads.pop(handle, None)
            self.error = self._explained(error)
            self.stop()
        if not self.running:
            self.stop()

    def _explained(self, error: Exception) -> ScriptError:
        line = self.compiled.place(error)
        if isinstance(error, ScriptError):
            return ScriptError(error.text, error.line or line, error.column or 1)
        if isinstance(error, RecursionError):
            return ScriptError("runtime_error: functions call each other, or themselves, too deeply", line, 1)
        if isinstance(error, NameError):
            name = str(error.name or "").removeprefix("v_")
            return ScriptError(f"compile_error_name_not_found:{name}:", line, 1)
        return ScriptError(f"runtime_error: {_stated(error)}", line, 1)

    def _start(self, thread: Waiting) -> int:
        if len(self._threads) >= THREADS:
            raise ScriptError(f"runtime_error: more than {THREADS} threads")
        self._handles += 1
        self._threads[self._handles] = thread
        return self._handles

    def _run(self, function: Callable[..., Any], name: str, *arguments: Any, **named: Any) -> int:
        copied = self._operations.copied
        started = function(*map(copied, arguments), **{key: copied(value) for key, value in named.items()})
        if not isinstance(started, Generator):
            raise ScriptError(f"type_error_thread_expected:{name}:")
        return self._start(started)

    def _join(self, handle: int) -> Waiting:
        while handle in self._threads:
            yield

    def _kill(self, handle: int) -> None:
        thread = self._threads.pop(handle, None)
        if thread is not None:
            _close(thread)


def _stated(error: Exception) -> str:
    """Return an error of the interpreter in the terms of a script, whose functions have no `self`."""
    text = str(error).removeprefix("Functions.")
    counted = re.search(r"\(\) (takes .*) positional arguments? but (\d+) w", text)
    if counted is None:
        return text or type(error).__name__
    takes = re.sub(r"\d+", lambda number: str(int(number[0]) - 1), counted[1])
    return f"{text[: counted.start()]}() {takes} arguments but {int(counted[2]) - 1} were given"


def _halt() -> None:
    raise Halt


def _close(thread: Waiting) -> None:
    """End a thread; the thread that is running now ends when it next waits."""
    if inspect.getgeneratorstate(thread) != inspect.GEN_RUNNING:
        thread.close()
