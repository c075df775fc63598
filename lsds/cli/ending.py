"""The end of the process: threads and processes that a plugin left running are named and do not keep it alive."""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path
from typing import NoReturn

from lsds.safety.device_calls import LEFT

#: Maximum time that the interpreter may take to end by itself, s.
INTERPRETER_GRACE_S = 0.5


def end_process(code: int) -> NoReturn:
    """End the process with an exit code, even if threads or processes that a plugin has started still run.

    They get `INTERPRETER_GRACE_S`; then those that still run are named on stderr. The process does not wait for a
    thread in a hanging call: the call's error has named it.
    """
    for pid, name in _programs():
        _say(f"a plugin has left a process running: {pid} ({name})")
    if any(thread.name == LEFT for thread in threading.enumerate()):
        _leave(code)
    threading.Thread(target=_after_grace, args=(code,), name="lsds-ending", daemon=True).start()
    sys.exit(code)


def _after_grace(code: int) -> None:
    # The interpreter waits for others' threads and processes at its end, but not for this thread.
    threading.Event().wait(INTERPRETER_GRACE_S)
    _leave(code)


def _leave(code: int) -> NoReturn:
    for thread in threading.enumerate():
        if not thread.daemon and thread is not threading.main_thread():
            _say(f"a plugin's thread '{thread.name}' still runs; the process ends without it")
    if "multiprocessing" in sys.modules:
        import multiprocessing

        for child in multiprocessing.active_children():
            if not child.daemon:
                _say(f"a plugin's process {child.pid} ('{child.name}') still runs; it is ended")
                child.terminate()
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            continue
    os._exit(code)


def _say(text: str) -> None:
    try:
        print(f"warning: {text}", file=sys.stderr, flush=True)
    except (OSError, ValueError):
        return


def _programs() -> list[tuple[int, str]]:
    """Return the programs that this process has started and that still run; empty without /proc."""
    found = []
    for listed in Path("/proc/self/task").glob("*/children"):
        try:
            for pid in map(int, listed.read_text().split()):
                words = Path(f"/proc/{pid}/cmdline").read_text(errors="replace").split("\0")
                # Multiprocessing manages its own helpers and workers; a process that has ended has no words.
                if any(words) and not any("multiprocessing" in word for word in words) and not _forked(words):
                    found.append((pid, " ".join(words).strip()[:80]))
        except OSError:
            continue
    return found


def _forked(words: list[str]) -> bool:
    return words == Path("/proc/self/cmdline").read_text(errors="replace").split("\0")
