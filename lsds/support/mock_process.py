"""Runs a wire mock in a separate process, for tests and for rigs that start their own mocks."""

from __future__ import annotations

import contextlib
import json
import queue
import subprocess
import threading
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from lsds.errors import ConnectFailed, DeviceError
from lsds.support.processes import isolated_environment, module_command, read_lines

START_TIMEOUT_S = 60.0
"""Time within which a mock has to listen (s). Compiling the simulated gel takes 15 s of it, once on each machine."""
STOP_TIMEOUT_S = 5.0
"""Time limit for an answer of the process, and for its end after it was asked to stop, s; chosen."""


class MockProcess:
    """Runs `lsds mock NAME --control`. As a context manager it starts on entry and stops on exit.

    `options` are the mock's options by field name, with `faults` as a list of tables. The mock also ends when this
    process ends in any way, because that closes the mock's standard input.
    """

    def __init__(self, name: str, options: Mapping[str, Any] | None = None, *, seed: int = 0) -> None:
        self.name = name
        self._options = dict(options or {})
        self._seed = seed
        self._process: subprocess.Popen[str] | None = None
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._errors: list[str] = []
        self._readers: list[threading.Thread] = []
        self._asking = threading.Lock()
        self.addresses: dict[str, str] = {}

    @property
    def pid(self) -> int:
        """Process id. Raises DeviceError if the mock is not running."""
        return self._running().pid

    @property
    def alive(self) -> bool:
        """Whether the mock is running."""
        return self._process is not None and self._process.poll() is None

    def start(self) -> Self:
        """Start the mock and wait until it listens. Raises ConnectFailed with its error output if it does not."""
        environment = isolated_environment({"PYTHONUNBUFFERED": "1"})
        # Nothing of an earlier process of this mock counts.
        self._lines, self._errors, self.addresses, self._late = queue.Queue(), [], {}, False
        self._process = subprocess.Popen(
            module_command("lsds.cli.main", "mock", *self._arguments()),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
            # Ctrl-C in a terminal signals the whole process group; the mock should end after its clients, not before.
            start_new_session=True,
        )
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        self._readers = [
            threading.Thread(target=read_lines, args=(self._process.stdout, self._lines.put), daemon=True),
            threading.Thread(target=read_lines, args=(self._process.stderr, self._note), daemon=True),
        ]
        for reader in self._readers:
            reader.start()
        try:
            self.addresses = dict(self._first_answer()["addresses"])
        except BaseException:
            self.stop()
            raise
        return self

    def inject(self, kind: str, **fault: Any) -> None:
        """Begin a fault now. Raises DeviceError if the mock refuses it."""
        self.request({"kind": kind, **fault})

    def request(self, table: Mapping[str, Any]) -> dict[str, Any]:
        """Send one line to the mock's control channel and return the answer. Raises DeviceError if it is refused."""
        # One request at a time, so that each thread gets the answer to its own.
        with self._asking:
            process = self._running()
            assert process.stdin is not None
            if self._late:
                # Its answer to the request before would be taken for that to this one.
                raise DeviceError(f"mock {self.name}", "did not answer the request before this one (start it again)")
            try:
                process.stdin.write(json.dumps(table) + "\n")
                process.stdin.flush()
                line = self._lines.get(timeout=STOP_TIMEOUT_S)
            except queue.Empty:
                line, self._late = None, True
            except (OSError, ValueError):
                line = None
        if line is None:
            problem = f"does not answer on its control channel; error output: {self.complaints.strip() or 'none'}"
            raise DeviceError(f"mock {self.name}", problem)
        answer: dict[str, Any] = json.loads(line)
        if not answer.get("ok"):
            raise DeviceError(f"mock {self.name}", str(answer.get("error")))
        return answer

    def ask_to_end(self) -> None:
        """Request the mock to end, without waiting."""
        if self._process is not None and self._process.stdin is not None:
            with contextlib.suppress(OSError):
                self._process.stdin.close()

    def stop(self) -> None:
        """Stop the mock: close its input, and kill it if it does not end in time."""
        process = self._process
        if process is None:
            return
        try:
            if process.stdin is not None and not process.stdin.closed:
                process.stdin.close()
            process.wait(STOP_TIMEOUT_S)
        except (subprocess.TimeoutExpired, OSError):
            process.kill()
            process.wait()
        for reader in self._readers:
            reader.join(STOP_TIMEOUT_S)
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()
        self._process = None

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.stop()

    @property
    def complaints(self) -> str:
        """Standard error output so far; empty if the mock reports no problem."""
        return "".join(self._errors)

    # -- inside -------------------------------------------------------------------------------------------

    def _arguments(self) -> list[str]:
        arguments = [self.name, "--control", "--json", "--seed", str(self._seed)]
        positional = []
        for name, value in self._options.items():
            flag = name.replace("_", "-")
            if name == "faults":
                for fault in value:
                    text = ",".join(f"{key}={_text(part)}" for key, part in fault.items())
                    arguments += ["--fault", text]
            elif isinstance(value, bool):
                arguments.append(f"--{flag}" if value else f"--no-{flag}")
            elif name == "":
                positional.append(_text(value))
            else:
                arguments += [f"--{flag}", _text(value)]
        return [*arguments, *positional]

    def _running(self) -> subprocess.Popen[str]:
        if self._process is None or self._process.poll() is not None:
            raise DeviceError(f"mock {self.name}", f"is not running; error output: {self.complaints.strip() or 'none'}")
        return self._process

    def _first_answer(self) -> dict[str, Any]:
        try:
            line = self._lines.get(timeout=START_TIMEOUT_S)
        except queue.Empty:
            line = ""
        if not line:
            if self._process is not None and self._process.poll() is not None:
                self._readers[1].join(1.0)
            reason = self.complaints.strip().removeprefix("error: ") or "no error output"
            raise ConnectFailed(
                f"mock {self.name}", f"did not start: {reason}", remedy=f"its options: lsds mock {self.name} --help"
            )
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _note(self, line: str | None) -> None:
        if line is not None:
            self._errors.append(line)


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(Path(value) if isinstance(value, Path) else value)
