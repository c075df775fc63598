"""A rig and its engine: in its own thread in real time, or step by step in simulated time."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING

import lsds
from lsds.clock import nanoseconds
from lsds.errors import DataError

if TYPE_CHECKING:
    from lerobot_robot_lsds.follow import Follow

READY_S = 10.0
"""Time limit for the first frames of the gel without contact (s)."""


class Running:
    """Runs a job from `start` to `stop`. The error that ends the run is raised at every later call.

    However it ends, the grip is kept: neither an error nor `stop` opens the fingers.
    """

    def __init__(self, config: lsds.RigConfig, job: Follow) -> None:
        self._config = config
        self._job = job
        self._stack = ExitStack()
        self._arrived = threading.Event()
        self._newest: lsds.Cycle | None = None
        self._cycles: Iterator[lsds.Cycle] | None = None
        self._error: BaseException | None = None

    def start(self) -> None:
        """Bring the rig up and wait for the reference. Raises BringUpError, SafetyStop, everything closed."""
        try:
            self.engine = self._stack.enter_context(lsds.bring_up(self._config, job=self._job))
            if self.engine.rig.virtual:
                self._cycles = iter(self.engine)
                self._pass(READY_S, until="idle")
                if self.engine.stage != "idle":
                    raise DataError(f"robot lsds: no reference of the gel within {READY_S:g} s (check the camera)")
            else:
                self.engine.observers.add("lerobot", self._take)
                self._grip = self._stack.enter_context(self.engine.background())
                self._grip.wait_for("idle", READY_S)
                if not self._arrived.wait(READY_S):
                    raise DataError(f"robot lsds: no frame within {READY_S:g} s (check the camera)")
        except BaseException as error:
            self._error = error
            self._close()
            raise

    def newest(self, step_s: float) -> lsds.Cycle:
        """Return the newest cycle; simulated time passes by `step_s` before. Raises the error that ended the run."""
        if self._error is None:
            try:
                self._pass(step_s)
            except BaseException as error:
                self._error = error
        self.check()
        assert self._newest is not None, "start() waits for the first frame"
        return self._newest

    def check(self) -> None:
        """Raise the error that ended the run, if there was one."""
        if self._error is None and self._cycles is None:
            try:
                self._grip.check()
            except BaseException as error:
                self._error = error
        if self._error is not None:
            raise self._error

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
        self._newest = cycle
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
        raise DataError("robot lsds: the run has ended; disconnect and connect again")
