"""The wire mock of a Robotiq gripper: its faces around one register machine, in one thread."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from lsds.clock import nanoseconds
from lsds.errors import ConfigError, ConfigIssue, ConnectFailed
from lsds_mocks.wire.faults import MESSAGE_FAULTS, Fault, FaultInjector, FaultKind
from lsds_mocks.wire.journal import History, Journal
from lsds_mocks.wire.robotiq.fingers import clearing, finger_link
from lsds_mocks.wire.robotiq.layout import Trouble
from lsds_mocks.wire.robotiq.line import SerialLine
from lsds_mocks.wire.robotiq.machine import RegisterMachine
from lsds_mocks.wire.robotiq.options import OFF, RobotiqOptions
from lsds_mocks.wire.robotiq.reactor import Reactor
from lsds_mocks.wire.robotiq.sockets import TcpFace
from lsds_mocks.wire.robotiq.terminal import TerminalFace
from lsds_mocks.wire.robotiq.urcap import UrcapSession
from lsds_mocks.wire.serving_thread import ServingThread

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds.contracts.plant_links import FingerLink
    from lsds.contracts.wire import ReceivedFrame

MOCK = "robotiq mock"
SERIAL = ("pty", "tcp")
FACES = (*SERIAL, "urcap")
KNOWS: dict[FaultKind, tuple[str, ...]] = {
    **dict.fromkeys(MESSAGE_FAULTS, FACES),
    "crc": SERIAL,
    "wrong-slave": SERIAL,
    "freeze": (),
    "disconnect": FACES,
    "busy": FACES,
    "gripper-fault": (),
}
_CODES = frozenset(int(trouble) for trouble in Trouble)
_TICK_NS = 20_000_000
"""Longest interval between two steps of an idle machine, and between two checks for faults, ns; chosen."""
_BUSY_TICK_NS = 2_000_000
"""Longest interval between two steps of a busy machine, ns; chosen."""
_LINE_RETRY_NS = 100_000_000
"""Pause before a face whose port is taken is opened again, ns; chosen."""
_URCAP_CLIENTS = 16
"""Maximum number of clients of the URCap port at once; chosen."""


class RobotiqMock:
    """A `WireMock`: serial line, RTU over TCP and URCap strings.

    Wire faults apply to the face that they name ("pty", "tcp", "urcap"). `busy` occupies a port as another program
    would; `disconnect` closes it and reopens it after `for_s`; `freeze` stops the registers; `gripper-fault` causes the
    gripper fault of a code.
    """

    def __init__(self, options: RobotiqOptions, context: BuildContext) -> None:
        self._options = options
        self._clock = context.clock
        for fault in options.faults:
            _require_known(fault.model_dump())
        self._faults = FaultInjector(MOCK, options.faults, KNOWS, seed=context.seed, clock=context.clock)
        self._link: FingerLink | None = None
        self._reactor: Reactor | None = None
        self._faces: list[TerminalFace | TcpFace] = []
        self._held: set[str] = set()
        self._journal = Journal(self._faults, context.clock, self._strike)
        self._history = History()
        self._serving = ServingThread(MOCK)

    def start(self) -> Mapping[str, str]:
        """Open all faces; return their addresses. Raises ConnectFailed if one is in use or there is no plant."""
        options = self._options
        self._link = finger_link(options, self._clock)
        self._machine = RegisterMachine(options, self._link, self._clock.now(), clearing(options, self._link))
        reactor = self._reactor = Reactor(self._clock)
        terminal = TerminalFace(MOCK, options.pty, reactor, partial(self._line, "pty"), options.baud)
        self._faces = [terminal]
        if options.tcp_port != OFF:
            address = (options.host, options.tcp_port)
            self._faces.append(TcpFace("tcp", MOCK, address, 1, reactor, partial(self._line, "tcp")))
        if options.urcap_port != OFF:
            address = (options.host, options.urcap_port)
            self._faces.append(TcpFace("urcap", MOCK, address, _URCAP_CLIENTS, reactor, self._strings))
        try:
            terminal.claim()
            for face in self._faces:
                face.open()
        except ConnectFailed:
            self.close()
            raise
        return {face.name: f"tcp://{face.address}" if face.name == "tcp" else face.address for face in self._faces}

    def serve(self, stop: threading.Event) -> None:
        """Answer clients until `stop` is set."""
        assert self._reactor is not None, "start() comes first"
        ticked = 0
        with self._serving.serving():
            while not stop.is_set():
                self._reactor.turn(_BUSY_TICK_NS if self._machine.busy else _TICK_NS)
                self._serving.turn()
                now = self._clock.now()
                self._machine.step(now)
                self._history.add(now, self._state())
                if now - ticked >= _TICK_NS:
                    ticked = now
                    self._strike()

    def inject(self, fault: Mapping[str, Any]) -> None:
        """Start a fault. Raises ConfigError for a fault that this mock does not support."""
        _require_known(fault)
        self._faults.add(fault)
        if self._reactor is not None:
            self._serving.run(self._strike)

    def end_fault(self, name: str) -> None:
        """End the faults of a name: registers follow again, ports open. A latched gripper fault needs its reset."""
        self._serving.run(partial(self._end_fault, name))

    def received(self, since: int) -> Sequence[ReceivedFrame]:
        """Return the Modbus requests and URCap lines with a number of at least `since`."""
        return self._journal.received(since)

    def truths(self, since_ns: int) -> Sequence[Mapping[str, Any]]:
        """Return the states of the fingers since a time: aperture, target (m), normal force per finger (N), object."""
        return self._serving.run(lambda: self._history.since(since_ns, self._clock.now(), self._state()))

    def close(self) -> None:
        """Close ports, terminal and link."""
        for face in self._faces:
            face.close()
        self._faces = []
        if self._reactor is not None:
            self._reactor.close()
            self._reactor = None
        if self._link is not None:
            self._link.close()
            self._link = None

    # -- inside -------------------------------------------------------------------------------------------

    def _line(self, face: str, send: Callable[[bytes], None]) -> SerialLine:
        assert self._reactor is not None
        return SerialLine(face, self._options, self._machine, self._faults, self._reactor, send, self._journal)

    def _strings(self, send: Callable[[bytes], None]) -> _Strings:
        assert self._reactor is not None
        return _Strings(self._machine, self._faults, self._reactor, send, self._journal)

    def _strike(self) -> None:
        """Apply the faults that do not belong to a message."""
        if self._faults.quiet:
            return
        now_ns = self._clock.now()
        if (fault := self._faults.strikes("gripper-fault", "")) is not None:
            self._machine.fail(fault.code, now_ns)
        if (fault := self._faults.strikes("freeze", "")) is not None:
            self._machine.freeze(self._ends(fault, now_ns))
        for face in self._faces:
            if face.up and (fault := self._faults.strikes("disconnect", face.name)) is not None:
                face.drop()
                self._later(self._ends(fault, now_ns), partial(self._reopen, face))
            elif face.name not in self._held and (fault := self._faults.strikes("busy", face.name)) is not None:
                self._held.add(face.name)
                face.hold(True)
                self._later(self._ends(fault, now_ns), partial(self._release, face))

    def _end_fault(self, name: str) -> None:
        self._faults.end(name)
        # Another fault of the same kind that is still on takes effect again in `_strike`.
        self._machine.freeze(self._clock.now())
        for face in self._faces:
            if not face.up:
                self._reopen(face)
            if face.name in self._held:
                self._release(face)
        self._strike()

    def _state(self) -> dict[str, Any]:
        """Return the state of the fingers. A mock without an object has the object state "none"."""
        assert self._link is not None
        fingers, options = self._link.fingers(), self._options
        alone = not options.cell and options.object_mm is None and options.hollow_mm is None
        return {
            "aperture_m": fingers.aperture_m,
            "target_m": fingers.target_m,
            "normal_n": fingers.normal_n,
            "moving": fingers.moving,
            "object": "none" if alone else "held" if fingers.normal_n > 0 else "free",
        }

    def _ends(self, fault: Fault, now_ns: int) -> int | None:
        left = self._faults.remaining_s(fault)
        return None if left is None else now_ns + nanoseconds(left)

    def _later(self, t_ns: int | None, call: Callable[[], None]) -> None:
        if t_ns is not None and self._reactor is not None:
            self._reactor.call_at(t_ns, call)

    def _reopen(self, face: TerminalFace | TcpFace) -> None:
        if face.up:
            return
        try:
            face.open()
        except ConnectFailed:
            # Another program took the port meanwhile; it may become free again.
            self._later(self._clock.now() + _LINE_RETRY_NS, partial(self._reopen, face))

    def _release(self, face: TerminalFace | TcpFace) -> None:
        self._held.discard(face.name)
        face.hold(False)


class _Strings:
    """One URCap client's session, with wire faults on its answers."""

    def __init__(
        self,
        machine: RegisterMachine,
        faults: FaultInjector,
        reactor: Reactor,
        send: Callable[[bytes], None],
        journal: Journal,
    ) -> None:
        self._session = UrcapSession(machine, partial(journal.note, "urcap"))
        self._faults = faults
        self._reactor = reactor
        self._send: Callable[[bytes], None] | None = send

    def receive(self, data: bytes) -> None:
        now = self._reactor.now()
        reply = self._session.feed(data, now)
        if not reply:
            return
        for delay_s, part in self._faults.outgoing(reply, "urcap"):
            if delay_s <= 0:
                self._emit(part)
            else:
                self._reactor.call_at(now + nanoseconds(delay_s), partial(self._emit, part))

    def hang_up(self) -> None:
        self._send = None

    def _emit(self, part: bytes) -> None:
        if self._send is not None:
            self._send(part)


def _require_known(fault: Mapping[str, Any]) -> None:
    """Raise ConfigError for a code that is not a fault of the gripper; the injector checks all else."""
    code = fault.get("code", 0)
    if fault.get("kind") == "gripper-fault" and not code:
        remedy = f"value of the fault register, low four bits one of {_known_codes()}"
        raise ConfigError(MOCK, [ConfigIssue("fault.code", "is missing", remedy)])
    if fault.get("kind") == "gripper-fault" and isinstance(code, int) and code & 0x0F not in _CODES:
        remedy = f"low four bits one of {_known_codes()}"
        raise ConfigError(MOCK, [ConfigIssue("fault.code", f"{code} is no fault of this gripper", remedy)])


def _known_codes() -> str:
    return ", ".join(f"{code} (0x{code:02X})" for code in sorted(_CODES) if code)
