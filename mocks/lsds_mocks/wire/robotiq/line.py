"""The gripper's end of a serial line: byte time, turnaround and line faults, over any transport."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from lsds.clock import NS_PER_S, nanoseconds
from lsds_mocks.wire.robotiq.rtu import Deframer, answer, crc, meaning

if TYPE_CHECKING:
    from lsds_mocks.wire.faults import FaultInjector
    from lsds_mocks.wire.journal import Journal
    from lsds_mocks.wire.robotiq.machine import RegisterMachine
    from lsds_mocks.wire.robotiq.options import RobotiqOptions
    from lsds_mocks.wire.robotiq.reactor import Reactor

_BITS_PER_BYTE = 10
"""8N1."""
_MOST_REQUESTS = 32
"""Maximum number of requests in progress; further ones are lost, as on a line."""


class SerialLine:
    """Receives a client's bytes and passes answers to `send` at the time at which the line would have carried them."""

    def __init__(
        self,
        face: str,
        options: RobotiqOptions,
        machine: RegisterMachine,
        faults: FaultInjector,
        reactor: Reactor,
        send: Callable[[bytes], None],
        journal: Journal | None = None,
    ) -> None:
        self._face = face
        self._slave = options.slave
        self._byte_ns = _BITS_PER_BYTE * NS_PER_S // options.baud if options.baud else 0
        self._turnaround_ns = nanoseconds(options.turnaround_ms * 1e-3)
        self._machine = machine
        self._faults = faults
        self._reactor = reactor
        self._send: Callable[[bytes], None] | None = send
        self._journal = journal
        self._deframer = Deframer(self._note_damaged)
        self._free_ns = 0
        self._waiting = 0

    def receive(self, data: bytes) -> None:
        """Receive bytes from the client, and add the line's transmission time, which a pseudo-terminal lacks."""
        now = self._reactor.now()
        for frame in self._deframer.feed(data, now):
            if self._journal is not None:
                self._journal.note(self._face, frame, partial(meaning, frame, self._slave))
            if self._waiting < _MOST_REQUESTS:
                self._waiting += 1
                self._free_ns = max(self._free_ns, now) + len(frame) * self._byte_ns
                self._reactor.call_at(self._free_ns, partial(self._carry_out, frame))

    def hang_up(self) -> None:
        """Send nothing more."""
        self._send = None

    def _note_damaged(self, data: bytes) -> None:
        if self._journal is not None:
            self._journal.note(self._face, data, "damaged: no request with a valid CRC")

    def _carry_out(self, frame: bytes) -> None:
        self._waiting -= 1
        now = self._reactor.now()
        message = answer(frame, self._slave, self._machine, now)
        if message is None:
            return
        if not self._faults.quiet:
            message = self._spoilt(message)
        due = now + self._turnaround_ns
        # A message delayed by a fault does not keep the line busy.
        self._free_ns = max(self._free_ns, due + len(message) * self._byte_ns)
        for delay_s, part in self._faults.outgoing(message, self._face):
            due += len(part) * self._byte_ns
            self._reactor.call_at(due + nanoseconds(delay_s), partial(self._emit, part))

    def _spoilt(self, message: bytes) -> bytes:
        if self._faults.strikes("wrong-slave", self._face):
            message = bytes((message[0] % 247 + 1,)) + message[1:-2]
            message += crc(message)
        if self._faults.strikes("crc", self._face):
            message = message[:-1] + bytes((message[-1] ^ 0xFF,))
        return message

    def _emit(self, part: bytes) -> None:
        if self._send is not None:
            self._send(part)
