"""A client under test in its own process: calls with a time limit, so that a hang or a crash ends only the client."""

from __future__ import annotations

import json
import os
import queue
import re
import signal
import subprocess
import threading
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Self

from lsds.clock import NS_PER_S, WallClock
from lsds.errors import DataError
from lsds.support.processes import isolated_environment, module_command, read_lines

CLOCK = WallClock()
IMPORT_S = 30.0
"""Time within which the client's module has to be imported (s)."""
CLIENT_CLOSE_S = 3.0
"""Time limit of `close` of a client (s); chosen."""


@dataclass(frozen=True, slots=True)
class Call:
    """A call of the client and what it answered: a value, an error as text, or how the call ended without an answer.

    Times are monotonic, ns. `ending` is "" for an answer, "hang" for none within the limit, else how the process died.
    """

    name: str
    began_ns: int
    ended_ns: int
    value: Any = None
    error: str = ""
    ending: str = ""

    @property
    def lasted_s(self) -> float:
        """Duration of the call (s)."""
        return (self.ended_ns - self.began_ns) / NS_PER_S


class DrivenClient:
    """The process of the client MODULE:CLASS. `close` ends it in any case."""

    def __init__(self, named: str) -> None:
        self.named = named
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._errors: list[str] = []
        self._ended = False
        self._process = subprocess.Popen(
            module_command("lsds.testing.torture.serve_client", named),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            env=isolated_environment({"PYTHONUNBUFFERED": "1"}),
            start_new_session=True,
        )
        self._readers = [
            threading.Thread(target=read_lines, args=(self._process.stdout, self._lines.put), daemon=True),
            threading.Thread(target=read_lines, args=(self._process.stderr, self._note), daemon=True),
        ]
        for reader in self._readers:
            reader.start()

    def described(self) -> tuple[str, dict[str, Any]]:
        """Return the transport and the mock's options that the client names. Raises DataError if it has no class."""
        try:
            line = self._lines.get(timeout=IMPORT_S)
        except queue.Empty:
            line = None
        answer: dict[str, Any] = {"error": f"no answer; {self.last_words}"} if line is None else json.loads(line)
        if answer.get("error"):
            self.close()
            module = self.named.partition(":")[0]
            lacks = re.match(r"ModuleNotFoundError: No module named '([^']+)'", answer["error"])
            if lacks and not module.startswith(lacks[1].split(".")[0]):
                raise DataError(f"client {self.named}: {answer['error']}; install it for this Python")
            raise DataError(f"client {self.named}: {answer['error']}; write MODULE:CLASS as Python imports it here")
        return str(answer["value"]["transport"]), dict(answer["value"]["options"])

    @property
    def alive(self) -> bool:
        """Whether its process runs."""
        return self._process.poll() is None

    @property
    def last_words(self) -> str:
        """The last line of its standard error."""
        return next((line.strip() for line in reversed(self._errors) if line.strip()), "no error output")

    def call(self, name: str, *args: Any, limit_s: float) -> Call:
        """Call a method; a client that does not answer in time or dies is ended."""
        began_ns = CLOCK.now()
        line: str | None = None
        ending = ""
        try:
            assert self._process.stdin is not None
            self._process.stdin.write(json.dumps({"call": name, "args": args}) + "\n")
            self._process.stdin.flush()
            line = self._lines.get(timeout=limit_s)
        except queue.Empty:
            ending = "hang"
        except (OSError, ValueError):
            pass
        ended_ns = CLOCK.now()
        if line is None:
            if not ending:
                ending = self._how_it_died()
            self._kill()
            return Call(name, began_ns, ended_ns, ending=ending)
        answer = json.loads(line)
        return Call(name, began_ns, ended_ns, answer.get("value"), answer.get("error", ""))

    def death(self) -> Call | None:
        """Return a call without a name if the process has died by itself since the last one, else None."""
        if self._ended or self.alive:
            return None
        now_ns = CLOCK.now()
        ending = self._how_it_died()
        self._kill()
        return Call("", now_ns, now_ns, ending=ending)

    def close(self) -> None:
        """Close the client and end its process."""
        if self.alive:
            self.call("close", limit_s=CLIENT_CLOSE_S)
        self._kill()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _how_it_died(self) -> str:
        try:
            code = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            return "closed its output"
        self._readers[1].join(1.0)
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        return f"died with {how}: {self.last_words}"

    def _kill(self) -> None:
        self._ended = True
        # Processes that the client has started hold its output open: closing it here would wait for their end.
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        for reader in self._readers:
            reader.join(1.0)
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            if stream is not None:
                with suppress(OSError):
                    stream.close()

    def _note(self, line: str | None) -> None:
        if line is not None:
            self._errors.append(line)
