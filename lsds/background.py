"""A run in a thread of its own, next to somebody else's program."""

from __future__ import annotations

import threading
from typing import Protocol

from lsds.errors import DataError

#: How often a stage is looked at, s.
_LOOK_S = 0.01


class Runs(Protocol):
    """What can run in the background: an engine."""

    @property
    def stage(self) -> str:
        """Where its job is."""
        ...

    def run(self) -> None:
        """Run to the end."""
        ...

    def stop(self) -> None:
        """End the run soon; from any thread."""
        ...


class Background:
    """An engine that runs in a thread of its own."""

    def __init__(self, engine: Runs) -> None:
        self._engine = engine
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="lsds-engine", daemon=True)

    @property
    def stage(self) -> str:
        """Where the job is."""
        return self._engine.stage

    @property
    def alive(self) -> bool:
        """Whether the run still goes on."""
        return self._thread.is_alive()

    def check(self) -> None:
        """Raise what ended the run, if it was an error."""
        if self._error is not None:
            raise self._error

    def start(self) -> None:
        """Begin to run."""
        self._thread.start()

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait for the job to be done; return whether it is. Raises what ended the run."""
        self._thread.join(timeout_s)
        self.check()
        return not self._thread.is_alive()

    def wait_for(self, stage: str, timeout_s: float = 30.0) -> None:
        """Wait until the job is at a stage. Raises what ended the run, DataError where it is not there in time."""
        for _ in range(max(1, round(timeout_s / _LOOK_S))):
            if self.stage == stage:
                return
            if self.wait(_LOOK_S):
                break
        raise DataError(f"the job did not reach '{stage}' within {timeout_s:g} s; it is at '{self.stage}'")

    def end(self) -> None:
        """End the run and wait for that."""
        self._engine.stop()
        self._thread.join()

    def _run(self) -> None:
        try:
            self._engine.run()
        except BaseException as error:
            self._error = error
