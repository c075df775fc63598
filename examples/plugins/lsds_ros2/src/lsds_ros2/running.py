"""A rig and its engine: in its own thread in real time, or step by step in simulated time."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack

import lsds
from lsds.clock import nanoseconds
from lsds.contracts import Job
from lsds.errors import DataError

READY_S = 10.0
"""Time limit for the first frames of the gel without contact (s)."""


class Running:
    """Runs a job from `start` to `stop`. The error that ends the run is raised at every later call.

    However it ends, the grip is kept: neither an error nor `stop` opens the fingers.
    """

    def __init__(self, rig: str, overrides: Sequence[str], job: Job) -> None:
        """Load the configuration. Raises ConfigError."""
        self._config = lsds.load_config(rig or None, overrides)
        self._job = job
        self._stack = ExitStack()
        self._arrived = threading.Event()
        self._cycles: Iterator[lsds.Cycle] | None = None
        self._error: BaseException | None = None
        self.newest: lsds.Cycle | None = None

    def start(self) -> None:
        """Bring the rig up and wait for the reference. Raises BringUpError, SafetyStop, everything closed."""
        try:
            self.engine = self._stack.enter_context(lsds.bring_up(self._config, job=self._job))
            if self.engine.rig.virtual:
                self._cycles = iter(self.engine)
                self._pass(READY_S, until="idle")
                ready = self.engine.stage == "idle"
            else:
                self.engine.observers.add("ros2", self._take)
                self._background = self._stack.enter_context(self.engine.background())
                self._background.wait_for("idle", READY_S)
                ready = self._arrived.wait(READY_S)
            if not ready:
                raise DataError(f"node lsds: no reference of the gel within {READY_S:g} s (check the camera)")
        except BaseException as error:
            self._error = error
            self._close()
            raise

    def advance(self, step_s: float) -> None:
        """Let simulated time pass; does nothing in real time. Raises the error that ended the run."""
        if self._error is None:
            try:
                if self._cycles is not None:
                    self._pass(step_s)
                else:
                    self._background.check()
            except BaseException as error:
                self._error = error
        if self._error is not None:
            raise self._error

    @property
    def error(self) -> BaseException | None:
        """The error that ended the run, as far as `advance` has raised it."""
        return self._error

    def stop(self) -> None:
        """Stop and close the rig; the grip is kept. Raises an error that was not raised before."""
        try:
            self._close()
        except BaseException as error:
            if error is not self._error:
                raise

    def _close(self) -> None:
        cycles, self._cycles = self._cycles, None
        if cycles is not None:
            cycles.close()  # type: ignore[attr-defined]
        self._stack.close()

    def _take(self, cycle: lsds.Cycle) -> None:
        self.newest = cycle
        self._arrived.set()

    def _pass(self, span_s: float, until: str = "") -> None:
        """Let simulated time pass, by at least one frame, or until the job reaches a stage."""
        if self._cycles is None:
            return
        end_ns = self.engine.rig.clock.now() + nanoseconds(span_s)
        for cycle in self._cycles:
            self._take(cycle)
            if cycle.t_ns >= end_ns or (until and self.engine.stage == until):
                return
        raise DataError("node lsds: the run has ended; start the node again")
