"""Run an engine in its own thread, in parallel with another program."""

from __future__ import annotations

import threading
from typing import Protocol

from lsds.errors import DataError

#: Interval of checking the stage, s.
_STAGE_LOOK_S = 0.01


class Runs(Protocol):
    """An object that can run in the background, such as an engine."""

    @property
    def stage(self) -> str:
        """The stage of its job."""
        ...

    def run(self) -> None:
        """Run to the end."""
        ...

    def stop(self) -> None:
        """Request the end of the run; from any thread."""
        ...


class Background:
    """An engine that runs in its own thread."""

    def __init__(self, engine: Runs) -> None:
        self._engine = engine
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="lsds-engine", daemon=True)

    @property
    def stage(self) -> str:
        """The stage of the job."""
        return self._engine.stage

    @property
    def alive(self) -> bool:
        """True while the run is in progress."""
        return self._thread.is_alive()

    def check(self) -> None:
        """Raise the error that ended the run, if there was one."""
        if self._error is not None:
            raise self._error

    def add_note_to(self, error: BaseException) -> None:
        """Note at a program's error that the run had ended with an error, which may be its cause."""
        if self._error is not None and self._error is not error:
            error.add_note(f"the engine had ended before: {type(self._error).__name__}: {self._error}")

    def start(self) -> None:
        """Start the run."""
        self._thread.start()

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait until the job is done; return whether it is. Raises the error that ended the run."""
        self._thread.join(timeout_s)
        self.check()
        return not self._thread.is_alive()

    def wait_for(self, stage: str, timeout_s: float = 30.0) -> None:
        """Wait until the job reaches a stage. Raises the error that ended the run, DataError on a time-out."""
        for _ in range(max(1, round(timeout_s / _STAGE_LOOK_S))):
            if self.stage == stage:
                return
            if self.wait(_STAGE_LOOK_S):
                break
        raise DataError(f"the job did not reach '{stage}' within {timeout_s:g} s; it is at '{self.stage}'")

    def end(self, timeout_s: float | None = None) -> bool:
        """End the run and wait until it has ended, no longer than a time limit; return whether it has."""
        self._engine.stop()
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            self._engine.run()
        except BaseException as error:
            self._error = error
