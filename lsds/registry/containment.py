"""Run code of a plugin so that it cannot write to stdout or change the streams and folder of the process."""

from __future__ import annotations

import io
import os
import sys
import tempfile
import threading
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from typing import Any, TextIO

LONGEST_TEXT = 200
"""Characters of a plugin's output or error message that are kept."""


class Output:
    """The text printed inside `contained`, available at its end."""

    text = ""


@contextmanager
def contained(*, filters: bool = True) -> Iterator[Output]:
    """Keep the output on stdout from the terminal, and restore stdout, stderr and the current folder at the end.

    Threads that ran before keep their output. Output of C code (file descriptor 1) is caught only if no such thread
    exists, because the descriptor is common to all. `filters` restores the warning filters too; leave it out when
    libraries are imported, which add filters for good.
    """
    output = Output()
    others = _other_threads()
    with ExitStack() as stack:
        if filters:
            stack.enter_context(warnings.catch_warnings())
        raw = None if others else stack.enter_context(_descriptor_caught())
        caught = _Caught(sys.stdout, others)
        try:
            with _in_place_of_stdout(caught):
                yield output
        finally:
            output.text = one_line(caught.getvalue() + (_contents(raw) if raw is not None else ""))


@contextmanager
def diverted() -> Iterator[None]:
    """Send to stderr what is written to stdout, and restore the streams and the current folder at the end.

    As with `contained`, threads that ran before keep their output, and output of C code is sent only without any.
    """
    others = _other_threads()
    with nullcontext() if others else _descriptor_diverted(), _in_place_of_stdout(_Diverted(sys.stdout, others)):
        yield


def one_line(text: object) -> str:
    """Return a text, or that of an exception, as one line of limited length; never raises."""
    try:
        line = " ".join(str(text).split())
    except Exception:
        return "(no text)"
    return line if len(line) <= LONGEST_TEXT else line[: LONGEST_TEXT - 4] + " ..."


@contextmanager
def _in_place_of_stdout(stream: _Caught) -> Iterator[None]:
    """Let a stream be stdout; restore stdout, stderr and the current folder at the end."""
    streams, folder = (sys.stdout, sys.stderr), _folder()
    sys.stdout = stream
    try:
        yield
    finally:
        stream.open = False
        sys.stdout, sys.stderr = _unwrapped(streams[0]), streams[1]
        if folder is not None and _folder() != folder:
            with suppress(OSError):
                os.chdir(folder)


def _other_threads() -> set[int | None]:
    return {thread.ident for thread in threading.enumerate()} - {threading.get_ident()}


class _Caught(io.StringIO):
    """A stream that keeps what a plugin writes, and passes on what other threads write, or anybody after the end."""

    def __init__(self, original: TextIO | None, others: set[int | None]) -> None:
        super().__init__()
        self.open = True
        self.original = original
        self._others = others

    def write(self, text: str) -> int:
        if self.open and threading.get_ident() not in self._others:
            return self.keep(text)
        # A program without a terminal has no stdout.
        return self.original.write(text) if self.original is not None else len(text)

    def keep(self, text: str) -> int:
        """Keep what the plugin writes."""
        return super().write(text)

    def flush(self) -> None:
        if not self.open and self.original is not None:
            self.original.flush()

    def close(self) -> None:
        """Do nothing: a plugin may not close the stdout of the program."""

    def fileno(self) -> int:
        return self.original.fileno() if self.original is not None else super().fileno()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.original, name)


class _Diverted(_Caught):
    """A stream that sends what a plugin writes to stderr, and passes on the rest as `_Caught` does."""

    def keep(self, text: str) -> int:
        """Write to stderr, if the program has one."""
        return sys.stderr.write(text) if sys.stderr is not None else len(text)


def _unwrapped(stream: Any) -> Any:
    """Return the stream below those of other threads that have ended in the meantime."""
    while isinstance(stream, _Caught) and not stream.open:
        stream = stream.original
    return stream


def _folder() -> str | None:
    try:
        return os.getcwd()
    except OSError:
        return None


@contextmanager
def _descriptor_caught() -> Iterator[Any]:
    """Point file descriptor 1 at a temporary file, which is given; None where there is no such descriptor."""
    try:
        _flush()
        kept = os.dup(1)
    except OSError:
        yield None
        return
    try:
        with tempfile.TemporaryFile() as file:
            os.dup2(file.fileno(), 1)
            try:
                yield file
            finally:
                os.dup2(kept, 1)
    finally:
        os.close(kept)


@contextmanager
def _descriptor_diverted() -> Iterator[None]:
    """Point file descriptor 1 at descriptor 2, if the process has both."""
    try:
        _flush()
        _flush_c()
        kept = os.dup(1)
    except OSError:
        yield
        return
    try:
        with suppress(OSError):
            os.dup2(2, 1)
        yield
    finally:
        _flush()
        _flush_c()
        os.dup2(kept, 1)
        os.close(kept)


def _contents(file: Any) -> str:
    _flush()
    _flush_c()
    file.seek(0)
    data: bytes = file.read(64 * 1024)
    return data.decode("utf-8", "replace")


def _flush() -> None:
    for stream in (sys.stdout, sys.__stdout__):
        with suppress(AttributeError, ValueError):
            if stream is not None:
                stream.flush()


def _flush_c() -> None:
    """Write out what C code has buffered, which would otherwise reach stdout when the process ends."""
    with suppress(ImportError, OSError, TypeError, AttributeError):
        import ctypes

        ctypes.CDLL(None).fflush(None)
