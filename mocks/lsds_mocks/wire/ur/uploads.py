"""Compilation of uploaded scripts in parallel with the control loop, in the order of their arrival."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from lsds_mocks.wire.ur.functions import waiting
from lsds_mocks.wire.ur.script.compilation import Compilation
from lsds_mocks.wire.ur.script.compiler import LONGEST_PROGRAM, Compiled
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.sender import Sender, listening_ports

Ports = Callable[[], frozenset[int]]
"""Returns the ports on which a program's sender listens."""

if TYPE_CHECKING:
    from lsds.clock import Clock

CACHED = 64
"""Maximum number of compiled programs in the cache; chosen."""
CACHED_CHARACTERS = 500_000
"""Maximum number of characters of the programs in the cache; chosen."""
WAITING_PROGRAMS = 64
"""Maximum number of programs that wait to be compiled or started; further ones are refused; chosen."""
WAITING_CHARACTERS = 4_000_000
"""Maximum number of characters of those programs; further ones are refused; chosen."""


Script = tuple[str, Ports]
"""A program's text, and the ports to which it may open sockets."""


class Uploads:
    """A thread that compiles scripts. The control loop's thread gets the results from `poll`.

    `ports` are those to which programs may open sockets; None: those on which a program's sender listens.
    """

    def __init__(self, clock: Clock, ports: Sequence[int] | None = None) -> None:
        self._ports = None if ports is None else frozenset(ports)
        self._texts: queue.SimpleQueue[tuple[Callable[[], Script], int] | None] = queue.SimpleQueue()
        self._ready: queue.SimpleQueue[tuple[Compiled | ScriptError | None, int]] = queue.SimpleQueue()
        self._cache: dict[str, Compiled] = {}
        self._compilation = Compilation(waiting(), clock)
        self._worker = threading.Thread(target=self._work, name="urscript compiler", daemon=True)
        self._waiting = self._characters = self._cancelled = 0
        self._refused = False

    def start(self) -> None:
        """Start the worker."""
        self._compilation.start()
        self._worker.start()

    def submit(self, text: str, sender: Sender | None = None) -> None:
        """Compile a script."""
        ports: Ports = frozenset if sender is None else partial(listening_ports, sender)
        self._take(lambda: (text, ports), len(text))

    def fetch(self, script: Callable[[], Script]) -> None:
        """Call a function in the worker and compile the script that it returns; "" for no script.

        The function may wait, return up to `LONGEST_PROGRAM` characters, and raise ScriptError.
        """
        self._take(script, LONGEST_PROGRAM)

    def cancel(self) -> None:
        """Drop the primary programs that wait to be compiled or started."""
        self._cancelled = self._waiting

    def poll(self) -> Compiled | ScriptError | None:
        """Return the next compiled program or error; one per call, so that no program is replaced before it runs."""
        if self._refused:
            self._refused = False
            return ScriptError("runtime_error: too many programs at once", 1, 1)
        try:
            found, characters = self._ready.get_nowait()
        except queue.Empty:
            return None
        self._waiting -= 1
        self._characters -= characters
        if self._cancelled:
            self._cancelled -= 1
            if isinstance(found, Compiled) and not found.secondary:
                return None
        return found

    def close(self) -> None:
        """End the worker."""
        self._texts.put(None)
        if self._worker.is_alive():
            self._worker.join(2.0)
        self._compilation.close()

    def _take(self, script: Callable[[], Script], characters: int) -> None:
        if self._waiting < WAITING_PROGRAMS and self._characters + characters <= WAITING_CHARACTERS:
            self._waiting += 1
            self._characters += characters
            self._texts.put((script, characters))
        else:
            self._refused = True

    def _work(self) -> None:
        while (task := self._texts.get()) is not None:
            script, characters = task
            self._ready.put((self._result(script), characters))

    def _result(self, script: Callable[[], Script]) -> Compiled | ScriptError | None:
        try:
            text, found = script()
        except ScriptError as error:
            return error
        if not text.strip():
            return None
        compiled = self._compiled(text)
        if isinstance(compiled, ScriptError) or "socket_open" not in text:
            return compiled
        return replace(compiled, ports=found() if self._ports is None else self._ports)

    def _compiled(self, text: str) -> Compiled | ScriptError:
        compiled = self._cache.get(text)
        if compiled is None:
            try:
                compiled = self._compilation.compile(text)
            except ScriptError as error:
                return error
        self._cache[text] = compiled
        while len(self._cache) > CACHED or sum(map(len, self._cache)) > CACHED_CHARACTERS:
            self._cache.pop(next(iter(self._cache)))
        return compiled
