"""A wire mock in its own process, for tests."""

from __future__ import annotations

import contextlib
import json
import queue
import subprocess
import threading
from collections.abc import Mapping
from typing import IO, Any

from lsds.errors import ConnectFailed
from lsds.support.processes import isolated_environment, module_command

START_S = 30.0
STOP_S = 5.0


class MockServer:
    """Runs `lsds mock NAME`. The mock ends when its standard input ends, so it cannot outlive this process."""

    def __init__(self, name: str, options: Mapping[str, Any] | None = None) -> None:
        self.name = name
        self._options = dict(options or {})
        self._process: subprocess.Popen[str] | None = None
        self._errors: list[str] = []

    def start(self) -> dict[str, str]:
        """Start it and return its addresses by face. Raises ConnectFailed with what it printed."""
        command = module_command("lsds.cli.main", "mock", self.name, "--control", "--json", *self._flags())
        pipe = subprocess.PIPE
        process = subprocess.Popen(
            command,
            stdin=pipe,
            stdout=pipe,
            stderr=pipe,
            text=True,
            env=isolated_environment({"PYTHONUNBUFFERED": "1"}),
            start_new_session=True,
        )
        self._process = process
        lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=_forward, args=(process.stdout, lines.put), daemon=True).start()
        errors = threading.Thread(target=_forward, args=(process.stderr, self._errors.append), daemon=True)
        errors.start()
        line = ""
        with contextlib.suppress(queue.Empty):
            line = lines.get(timeout=START_S)
        if not line:
            self.stop()
            errors.join(STOP_S)
            printed = "".join(self._errors).strip().removeprefix("error: ") or f"it printed nothing in {START_S:.0f} s"
            raise ConnectFailed(
                f"mock {self.name}", f"did not start: {printed}", remedy=f"lsds mock {self.name} --help"
            )
        return dict(json.loads(line)["addresses"])

    def stop(self) -> None:
        """End it, by force if it does not end by itself. A second call does nothing."""
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(OSError):
            if process.stdin is not None:
                process.stdin.close()
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def _flags(self) -> list[str]:
        flags: list[str] = []
        for name, value in self._options.items():
            flag = name.replace("_", "-")
            if isinstance(value, bool):
                flags.append(f"--{flag}" if value else f"--no-{flag}")
            else:
                flags += [f"--{flag}", str(value)]
        return flags


def _forward(stream: IO[str] | None, take: Any) -> None:
    """Pass on the lines of a stream, then "", and close it."""
    if stream is not None:
        with stream:
            for line in stream:
                take(line)
    take("")
