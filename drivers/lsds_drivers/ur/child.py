"""Start, read and end the child process that runs ur_rtde."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Mapping
from typing import Any

from lsds.errors import ConnectFailed, ConnectionLost, DeviceTimeout
from lsds.support.processes import isolated_environment, module_command
from lsds_drivers.ur.packets import LARGEST_PACKET, Kind, Reply, State, pack_request, unpack_reply, unpack_state

CHILD_END_S = 2.0
"""Time limit for the end of the child process, and for that of each thread that reads it (s); chosen."""


class Child:
    """One child process. `state` is its newest state; `ended` is the reason why it has ended."""

    def __init__(self, name: str, options: Mapping[str, Any]) -> None:
        self._name = name
        self.state: State | None = None
        self.ended: Reply | None = None
        self._reply: Reply | None = None
        self._requests = 0
        self._changed = threading.Condition()
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._link = ours
        try:
            self._process: subprocess.Popen[str] = subprocess.Popen(
                module_command("lsds_drivers.ur.worker", json.dumps(dict(options))),
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                env=isolated_environment({"OPENBLAS_NUM_THREADS": "1"}),
            )
        except OSError as error:
            ours.close()
            raise ConnectFailed(name, f"its process cannot be started: {error}") from error
        finally:
            theirs.close()
        self._stderr: list[str] = []
        self._threads = [
            threading.Thread(target=self._hear, name=f"{name} states", daemon=True),
            threading.Thread(target=self._note, name=f"{name} messages", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def send(self, packet: bytes) -> bool:
        """Send without waiting; return whether the packet was accepted."""
        try:
            return self._link.send(packet, socket.MSG_DONTWAIT) == len(packet)
        except OSError:
            return False

    def request(self, kind: Kind, timeout_s: float) -> Reply:
        """Send a request and return its reply. Raises DeviceTimeout, and DeviceError if the child has ended."""
        self._requests += 1
        self.send(pack_request(kind, self._requests))
        return self.await_reply(timeout_s)

    def await_reply(self, timeout_s: float) -> Reply:
        """Return the reply to the last request; ignores late replies to earlier requests.

        Raises DeviceTimeout, and DeviceError if the child has ended.
        """
        deadline = time.monotonic() + timeout_s
        with self._changed:
            while (reply := self._reply) is None or reply.request != self._requests:
                if self.ended is not None:
                    raise self.error()
                left = deadline - time.monotonic()
                if left <= 0:
                    raise DeviceTimeout(self._name, f"has not answered within {timeout_s:g} s", remedy="arm again")
                self._changed.wait(left)
        return reply

    def error(self) -> ConnectionLost:
        """Return the error with the reason why the child has ended."""
        ended = self.ended or Reply("its process has ended")
        return ConnectionLost(self._name, ended.problem, remedy=ended.remedy or "reconnect", code=ended.code)

    def close(self) -> None:
        """End the child: first by request, then by force."""
        self.send(bytes([Kind.QUIT]))
        try:
            self._process.wait(CHILD_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(CHILD_END_S)
        self._link.close()
        if self._process.stderr is not None:
            self._process.stderr.close()

    def _hear(self) -> None:
        """Keep the newest state; at the end, find out why it ended."""
        failed: Reply | None = None
        while True:
            try:
                data = self._link.recv(LARGEST_PACKET)
            except OSError:
                data = b""
            if not data:
                break
            if data[0] == Kind.STATE:
                self.state = unpack_state(data)
            elif data[0] == Kind.DONE:
                self._publish(reply=unpack_reply(data))
            elif data[0] == Kind.FAILED:
                failed = unpack_reply(data)
        self._publish(ended=failed or self._autopsy())

    def _autopsy(self) -> Reply:
        try:
            code = self._process.wait(CHILD_END_S)
        except subprocess.TimeoutExpired:
            return Reply("its process does not respond any more", "reconnect")
        if code < 0:
            name = signal.Signals(-code).name
            return Reply(f"ur_rtde's process was ended by {name}", "reconnect; the controller has stopped", -code)
        output = " ".join("".join(self._stderr).split())[-300:]
        return Reply(f"ur_rtde's process has ended{': ' + output if output else ''}", "reconnect", code)

    def _publish(self, *, reply: Reply | None = None, ended: Reply | None = None) -> None:
        with self._changed:
            if reply is not None:
                self._reply = reply
            if ended is not None:
                self.ended = ended
            self._changed.notify_all()

    def _note(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            self._stderr.append(line)
            del self._stderr[:-20]
