"""Wire mock `onrobot-rg2`: a Compute Box that speaks Modbus TCP, with one RG2 behind it."""

from __future__ import annotations

import contextlib
import selectors
import socket
import struct
import threading
from collections.abc import Mapping
from typing import Any

from lsds.contracts import BuildContext
from lsds.contracts.plant import attach
from lsds.contracts.plant_links import FingerLink
from lsds.errors import ConfigError, ConfigIssue, ConnectFailed
from pydantic import BaseModel, ConfigDict, Field

from lsds_onrobot_rg2.device import LoneFingers, Rg2Device

NAME = "onrobot-rg2"
FAULTS = ("silent", "exception", "wrong-answer", "safety-switch", "recovered")
LONGEST = 260
"""Length of the longest frame of Modbus TCP (bytes)."""
POLL_S, SEND_S = 0.05, 0.5
"""Time between looks at `stop`, and the limit of one send (s)."""
STROKE_M = 0.11
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, NO_ANSWER_BEHIND = 1, 2, 3, 11
"""Exception codes of Modbus; the last one is a gateway's, for a unit that does not answer."""


class ServerOptions(BaseModel):
    """Options of `lsds mock onrobot-rg2`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    host: str = Field(default="127.0.0.1", pattern=r"^127(\.\d+){3}$", description="loopback address to listen on")
    port: int = Field(default=0, ge=0, le=65535, description="TCP port; 0: a free one")
    unit: int = Field(default=65, ge=1, le=247, description="Modbus unit of the gripper")
    offset_mm: float = Field(default=0.0, ge=-20, le=20, description="fingertip offset of each finger")
    object_mm: float = Field(default=0.0, ge=0, le=110, description="width of an object between the fingers; 0: none")
    cell: str = Field(default="", description="socket of a plant shared with other mocks; empty: no plant")


class Rg2Server:
    """A `WireMock`. It serves any number of clients in one thread."""

    def __init__(self, options: ServerOptions, context: BuildContext) -> None:
        self._options = options
        self._context = context
        self._listener: socket.socket | None = None
        self._selector: selectors.BaseSelector | None = None
        self._fingers: FingerLink | None = None
        self._clients: dict[socket.socket, bytes] = {}
        self._fault = ""
        self.device: Rg2Device | None = None

    def start(self) -> Mapping[str, str]:
        """Listen. Raises ConnectFailed if the address is in use, or if no plant serves at `cell`."""
        options, clock = self._options, self._context.clock
        try:
            self._listener = socket.create_server((options.host, options.port))
        except OSError as error:
            problem = f"cannot listen on {options.host}:{options.port}: {error.strerror or error}"
            raise ConnectFailed(NAME, problem, remedy="choose another port: --port") from error
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        if options.cell:
            self._fingers = attach(self._context, options.cell).finger_link()
        else:
            self._fingers = LoneFingers(clock, STROKE_M, options.object_mm * 1e-3)
        self.device = Rg2Device(self._fingers, clock, round(options.offset_mm * 10))
        return {"tcp": f"{options.host}:{self._listener.getsockname()[1]}"}

    def serve(self, stop: threading.Event) -> None:
        """Serve clients until `stop` is set."""
        selector = self._selector
        if selector is None:
            return
        try:
            while not stop.is_set():
                for key, _ in selector.select(POLL_S):
                    if key.fileobj is self._listener:
                        self._accept(selector)
                    else:
                        self._attend(selector, key.fileobj)
        finally:
            for client in list(self._clients):
                self._leave(selector, client)

    def inject(self, fault: Mapping[str, Any]) -> None:
        """Start a fault: "silent", "exception", "wrong-answer", or "safety-switch" with `switch`; "recovered" ends the
        first three. Raises ConfigError for another one."""
        kind = fault.get("kind")
        if kind not in FAULTS:
            problem = f"'{kind}' is not a fault of {NAME}"
            raise ConfigError(NAME, [ConfigIssue("fault.kind", problem, f"one of: {', '.join(FAULTS)}")])
        if kind != "safety-switch":
            self._fault = str(kind)
        elif fault.get("switch", 1) not in (1, 2):
            raise ConfigError(NAME, [ConfigIssue("fault.switch", "there is no such safety switch", "1 or 2")])
        elif self.device is not None:
            self.device.trip(fault.get("switch", 1))

    def close(self) -> None:
        """Stop listening and release the plant. A second call does nothing."""
        selector, self._selector = self._selector, None
        if selector is not None:
            selector.close()
        listener, self._listener = self._listener, None
        if listener is not None:
            listener.close()
        fingers, self._fingers = self._fingers, None
        if fingers is not None:
            fingers.close()

    def answer(self, unit: int, request: bytes) -> bytes:
        """Return the answer to a request of Modbus (function code and data)."""
        function = request[0] if request else 0
        if unit != self._options.unit:
            return _refusal(function, NO_ANSWER_BEHIND)
        if self._fault == "exception":
            return _refusal(function, NO_ANSWER_BEHIND)
        try:
            if function == 3:
                return self._read(*struct.unpack(">HH", request[1:]))
            if function == 6:
                address, value = struct.unpack(">HH", request[1:])
                return self._write(address, [value]) or request
            if function == 16:
                address, count, size = struct.unpack(">HHB", request[1:6])
                words = list(struct.unpack(f">{size // 2}H", request[6:]))
                if len(words) != count:
                    return _refusal(function, ILLEGAL_VALUE)
                return self._write(address, words, function) or request[:5]
        except struct.error:
            return _refusal(function, ILLEGAL_VALUE)
        return _refusal(function, ILLEGAL_FUNCTION)

    def _read(self, address: int, count: int) -> bytes:
        assert self.device is not None
        if not 1 <= count <= 125:
            return _refusal(3, ILLEGAL_VALUE)
        values = [self.device.read(address + i) for i in range(count)]
        words = [value for value in values if value is not None]
        if len(words) != count:
            return _refusal(3, ILLEGAL_ADDRESS)
        if self._fault == "wrong-answer":
            words = words[1:]
        return struct.pack(f">BB{len(words)}H", 3, 2 * len(words), *words)

    def _write(self, address: int, words: list[int], function: int = 6) -> bytes:
        """Write all words or none; return a refusal, or nothing."""
        assert self.device is not None
        for i, word in enumerate(words):
            if not self.device.accepts(address + i, word):
                known = self.device.accepts(address + i, 1)
                return _refusal(function, ILLEGAL_VALUE if known else ILLEGAL_ADDRESS)
        for i, word in enumerate(words):
            self.device.write(address + i, word)
        return b""

    def _accept(self, selector: selectors.BaseSelector) -> None:
        assert self._listener is not None
        with contextlib.suppress(OSError):
            client, _ = self._listener.accept()
            client.settimeout(SEND_S)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._clients[client] = b""
            selector.register(client, selectors.EVENT_READ)

    def _attend(self, selector: selectors.BaseSelector, client: Any) -> None:
        """Answer the complete requests of a client. One that leaves or sends no Modbus is disconnected."""
        try:
            received = client.recv(4096)
            waiting = self._clients[client] + received
            while received and len(waiting) >= 7:
                transaction, protocol, length, unit = struct.unpack(">HHHB", waiting[:7])
                if protocol != 0 or not 2 <= length <= LONGEST - 6:
                    received = b""
                    break
                if len(waiting) < 6 + length:
                    break
                request, waiting = waiting[7 : 6 + length], waiting[6 + length :]
                if self._fault != "silent":
                    body = self.answer(unit, request)
                    client.sendall(struct.pack(">HHHB", transaction, 0, len(body) + 1, unit) + body)
            self._clients[client] = waiting
        except OSError:
            received = b""
        if not received:
            self._leave(selector, client)

    def _leave(self, selector: selectors.BaseSelector, client: socket.socket) -> None:
        selector.unregister(client)
        del self._clients[client]
        client.close()


def _refusal(function: int, code: int) -> bytes:
    return bytes([function | 0x80, code])
