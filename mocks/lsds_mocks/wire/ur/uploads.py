"""Uploaded scripts: compiled in parallel with the control loop, in the order of their arrival."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable

from lsds_mocks.wire.ur.functions import waiting
from lsds_mocks.wire.ur.script.compiler import Compiled, compile_script
from lsds_mocks.wire.ur.script.errors import ScriptError

CACHED = 64
WAITING = 64
"""Programs that may wait to be compiled; what comes beyond these is refused."""


class Uploads:
    """A worker thread that compiles. `poll` hands what is ready to the control loop's thread."""

    def __init__(self) -> None:
        self._texts: queue.SimpleQueue[Callable[[], str] | None] = queue.SimpleQueue()
        self._ready: queue.SimpleQueue[Compiled | ScriptError] = queue.SimpleQueue()
        self._cache: dict[str, Compiled] = {}
        self._worker = threading.Thread(target=self._work, name="urscript compiler", daemon=True)

    def start(self) -> None:
        """Start the worker."""
        self._worker.start()

    def submit(self, text: str) -> None:
        """Compile a script."""
        if self._texts.qsize() < WAITING:
            self._texts.put(lambda: text)
        elif self._ready.qsize() < WAITING:
            self._ready.put(ScriptError("runtime_error: too many programs at once", 1, 1))

    def fetch(self, script: Callable[[], str]) -> None:
        """Call a function in the worker, which may wait, and compile the script it returns; "" for none."""
        self._texts.put(script)

    def poll(self) -> list[Compiled | ScriptError]:
        """Return what has been compiled, or refused, since the last call."""
        found = []
        while True:
            try:
                found.append(self._ready.get_nowait())
            except queue.Empty:
                return found

    def close(self) -> None:
        """End the worker."""
        self._texts.put(None)
        if self._worker.is_alive():
            self._worker.join(2.0)

    def _work(self) -> None:
        while (script := self._texts.get()) is not None:
            text = script()
            if not text.strip():
                continue
            try:
                compiled = self._cache.get(text) or compile_script(text, waiting())
            except ScriptError as error:
                self._ready.put(error)
                continue
            except Exception as error:
                # Programs that Python cannot compile, such as more than a hundred levels of nesting. The next program
                # is still accepted.
                self._ready.put(ScriptError(f"syntax_error: {type(error).__name__}: {error}", 1, 1))
                continue
            while len(self._cache) >= CACHED:
                self._cache.pop(next(iter(self._cache)))
            self._cache[text] = compiled
            self._ready.put(compiled)
