"""`python -m lsds_mocks.wire.ur.script.compile_server`: compiles scripts for the mock arm, in a separate process.

Compiling holds the interpreter's lock, so a long program would stop the control loop meanwhile. The process also limits
memory and time. Requests and answers consist of a length (u32) and marshalled data.
"""

from __future__ import annotations

import marshal
import resource
import signal
import struct
import sys
from typing import Any, BinaryIO

from lsds_mocks.wire.ur.script.compiler import compile_script
from lsds_mocks.wire.ur.script.errors import ScriptError

MEMORY_BYTES = 512 << 20
"""Limit on the address space of the compiling process, bytes; chosen."""
PROCESSOR_S = 60
"""Limit on the processor time of the compiling process, s; chosen."""
LARGE = 100_000
"""Size of a program (characters) after which the process ends to free its memory."""


def answer(text: str, waiting: dict[str, bool]) -> tuple[Any, ...]:
    """Return (name, secondary, codes, places), or (error, line, column)."""
    try:
        compiled = compile_script(text, waiting)
        codes = tuple(map(marshal.dumps, compiled.codes))
    except ScriptError as error:
        return error.text, error.line, error.column
    except Exception as error:
        # Python cannot compile the program, for example because of more than a hundred levels of nesting.
        return f"syntax_error: {type(error).__name__}: {str(error)[:200]}", 1, 1
    return compiled.name, compiled.secondary, codes, dict(compiled.places)


def read(stream: BinaryIO) -> bytes:
    """Return the next message, b"" at the end."""
    head = stream.read(4)
    if len(head) < 4:
        return b""
    (size,) = struct.unpack(">I", head)
    return stream.read(size)


def main() -> None:
    """Answer requests until the input ends."""
    # Ignore Ctrl-C, which stops the mock; this process ends with the mock.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (PROCESSOR_S, PROCESSOR_S))
    while request := read(sys.stdin.buffer):
        text, waiting = marshal.loads(request)
        data = marshal.dumps(answer(text, waiting))
        sys.stdout.buffer.write(struct.pack(">I", len(data)) + data)
        sys.stdout.buffer.flush()
        if len(text) > LARGE:
            return


if __name__ == "__main__":
    main()
