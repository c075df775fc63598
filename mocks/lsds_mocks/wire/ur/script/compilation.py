"""Compilation of scripts in another process (`compile_server`) with a time limit; a process that ends is replaced."""

from __future__ import annotations

import contextlib
import marshal
import os
import select
import struct
import subprocess
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from lsds.clock import nanoseconds, seconds
from lsds.support.processes import module_command
from lsds_mocks.wire.ur.script.compiler import LONGEST_PROGRAM, Compiled
from lsds_mocks.wire.ur.script.errors import ScriptError

if TYPE_CHECKING:
    from lsds.clock import Clock

COMPILATION_LIMIT_S = 5.0
"""Time limit for the compilation of a program, s; chosen."""
LARGEST_BYTES = 64 << 20
"""Maximum size of a compiled program, bytes; chosen."""


class Compilation:
    """Compiles one script at a time, for one thread; `waiting` is that of `compile_script`."""

    def __init__(self, waiting: Mapping[str, bool], clock: Clock) -> None:
        self._waiting = dict(waiting)
        self._clock = clock
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start the process, so that it is ready for the first script."""
        self._process = subprocess.Popen(
            module_command("lsds_mocks.wire.ur.script.compile_server"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )

    def compile(self, text: str) -> Compiled:
        """Return the compiled script. Raises ScriptError if the script cannot be compiled, or not in time."""
        if len(text) >= LONGEST_PROGRAM:
            raise ScriptError(f"syntax_error: a program has at most {LONGEST_PROGRAM} characters", 1, 1)
        request = marshal.dumps((text, self._waiting))
        found: Any = ()
        for attempt in (1, 2):
            if self._process is None or self._process.poll() is not None:
                self.close()
                self.start()
            try:
                found = marshal.loads(self._exchange(struct.pack(">I", len(request)) + request))
                break
            except EOFError:
                # The previous program may have ended the process; if it ends again, this program is the cause.
                self.close()
                if attempt == 2:
                    raise ScriptError("syntax_error: the program is too large to be compiled", 1, 1) from None
            except TimeoutError:
                self.close()
                raise ScriptError(f"syntax_error: not compiled within {COMPILATION_LIMIT_S:g} s", 1, 1) from None
        if len(found) == 3:
            raise ScriptError(*found)
        name, secondary, codes, places = found
        return Compiled(name, secondary, tuple(map(marshal.loads, codes)), places)

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()

    def _exchange(self, request: bytes) -> bytes:
        """Send a request and return the answer. Raises EOFError if the process has ended, TimeoutError."""
        process = self._process
        assert process is not None
        assert process.stdin is not None
        assert process.stdout is not None
        ends_ns = self._clock.now() + nanoseconds(COMPILATION_LIMIT_S)
        try:
            process.stdin.write(request)
            process.stdin.flush()
        except OSError:
            raise EOFError from None
        (size,) = struct.unpack(">I", self._read(process.stdout.fileno(), 4, ends_ns))
        if size > LARGEST_BYTES:
            raise EOFError
        return self._read(process.stdout.fileno(), size, ends_ns)

    def _read(self, descriptor: int, size: int, ends_ns: int) -> bytes:
        data = bytearray()
        while len(data) < size:
            left = seconds(ends_ns - self._clock.now())
            if left <= 0 or not select.select([descriptor], [], [], left)[0]:
                raise TimeoutError
            part = os.read(descriptor, min(size - len(data), 1 << 20))
            if not part:
                raise EOFError
            data += part
        return bytes(data)
