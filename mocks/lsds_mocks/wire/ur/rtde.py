"""RTDE, the controller's real-time data exchange, protocol versions 1 and 2 (Universal Robots, "RTDE guide").

A package is big endian: u16 total size, u8 type, payload.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from functools import partial

from lsds_mocks.wire.faults import FaultInjector
from lsds_mocks.wire.ur.controller import Controller
from lsds_mocks.wire.ur.net import Link, ProtocolEnd
from lsds_mocks.wire.ur.variables import IN, Packer, Unpacker, output_type, packer, recipe_size

FASTEST_HZ = 500.0
"""Maximum rate of packages, Hz: one per control cycle of an e-Series arm."""
SLOWEST_HZ = 0.01
"""Minimum rate of packages, Hz."""
VERSION, CONTROLLER_VERSION, OUTPUTS, INPUTS, START, PAUSE, DATA, TEXT = map(ord, "VvOISPUM")
LARGEST_PACKAGE = 0xFFFF
"""Maximum size of a package, bytes: the size field has 16 bits."""
RECIPES = 255
"""Maximum number of input recipes of a client: one byte holds the number of a recipe."""


class RtdeFace:
    """All RTDE clients of one controller, with the inputs that each has claimed."""

    def __init__(self, controller: Controller, faults: FaultInjector) -> None:
        self.controller = controller
        self.faults = faults
        self.claimed: dict[str, RtdeSession] = {}
        self._sessions: list[RtdeSession] = []

    def open(self, link: Link) -> RtdeSession:
        """Take a new client."""
        session = RtdeSession(self, link)
        self._sessions.append(session)
        return session

    def forget(self, session: RtdeSession) -> None:
        """Remove a disconnected client and free its inputs."""
        if session in self._sessions:
            self._sessions.remove(session)
        self.claimed = {name: owner for name, owner in self.claimed.items() if owner is not session}

    def publish(self) -> None:
        """Send the present cycle to all clients."""
        for session in self._sessions:
            session.publish()


class RtdeSession:
    """One client."""

    at_once = 2048

    def __init__(self, face: RtdeFace, link: Link) -> None:
        self._face = face
        self._link = link
        self._buffer = bytearray()
        self._version = 1
        self._pack: Packer | None = None
        self._every = 1
        self._started = False
        self._inputs: dict[int, Unpacker] = {}

    def received(self, data: bytes) -> None:
        """Process data from the client. Raises ProtocolEnd for an invalid package."""
        self._buffer += data
        while len(self._buffer) >= 3:
            size, kind = struct.unpack_from(">HB", self._buffer)
            if size < 3:
                raise ProtocolEnd
            if len(self._buffer) < size:
                return
            package = bytes(self._buffer[:size])
            payload = package[3:]
            del self._buffer[:size]
            self._link.note(package, partial(self._meaning, kind, payload, dict(self._inputs)))
            self._handle(kind, payload)

    def closed(self) -> None:
        """The client is gone."""
        self._face.forget(self)

    def publish(self) -> None:
        """Send the present cycle if it is due at this client's frequency."""
        if self._started and self._pack is not None:
            controller = self._face.controller
            if controller.step_number % self._every == 0:
                self._link.send(self._pack(controller), may_drop=True)

    def _handle(self, kind: int, payload: bytes) -> None:
        if kind == DATA:
            self._data(payload)
        elif kind == VERSION:
            wanted = struct.unpack(">H", payload)[0] if len(payload) == 2 else 0
            accepted = wanted in (1, 2)
            if accepted:
                self._version = wanted
            self._reply(kind, bytes([accepted]))
        elif kind == CONTROLLER_VERSION:
            major, minor, bugfix, build = map(int, self._face.controller.options.version.split("."))
            self._reply(kind, struct.pack(">4I", major, minor, bugfix, build))
        elif kind == OUTPUTS:
            self._set_up_outputs(payload)
        elif kind == INPUTS:
            self._set_up_inputs(payload)
        elif kind == START:
            self._started = self._pack is not None
            self._reply(kind, bytes([self._started]))
        elif kind == PAUSE:
            self._started = False
            self._reply(kind, b"\x01")
        elif kind != TEXT:
            self._send_text(f"unknown package type {kind}")

    def _meaning(self, kind: int, payload: bytes, inputs: Mapping[int, Unpacker]) -> str:
        """Return a package in words; `inputs` are the recipes that were set up when it arrived."""
        if kind == DATA:
            recipe = inputs.get(payload[0]) if payload else None
            try:
                values = recipe.values(payload[1:]) if recipe is not None else {}
            except ValueError:
                values = {}
            return "input: " + (", ".join(f"{name}={value}" for name, value in values.items()) or "invalid")
        names = ", ".join(_names(payload[8:] if kind == OUTPUTS and self._version == 2 else payload))
        return {
            VERSION: f"request version {int.from_bytes(payload, 'big')}",
            CONTROLLER_VERSION: "request controller version",
            OUTPUTS: f"set-up outputs: {names}",
            INPUTS: f"set-up inputs: {names}",
            START: "start",
            PAUSE: "pause",
            TEXT: "text message",
        }.get(kind, f"unknown package type {kind}")

    def _set_up_outputs(self, payload: bytes) -> None:
        frequency = FASTEST_HZ
        if self._version == 2:
            if len(payload) < 8:
                raise ProtocolEnd
            (frequency,) = struct.unpack_from(">d", payload)
            payload = payload[8:]
        names = _names(payload)
        types = [output_type(name) or "NOT_FOUND" for name in names]
        in_range = SLOWEST_HZ <= frequency <= FASTEST_HZ
        fits = bool(names) and "NOT_FOUND" not in types and recipe_size(names) <= LARGEST_PACKAGE
        sound = fits and in_range
        head = bytes([DATA, 1] if self._version == 2 else [DATA])
        self._pack = packer(names, head) if sound else None
        self._every = round(FASTEST_HZ / frequency) if sound else 1
        self._started = self._started and sound
        if not in_range:
            self._send_text(f"frequency {frequency:g} Hz is out of range: {SLOWEST_HZ:g} to {FASTEST_HZ:g}")
        front = bytes([int(sound)]) if self._version == 2 else b""
        self._reply(OUTPUTS, front + ",".join(types).encode())

    def _set_up_inputs(self, payload: bytes) -> None:
        names = _names(payload)
        types = []
        for name in names:
            owner = self._face.claimed.get(name)
            if name not in IN:
                types.append("NOT_FOUND")
            elif (owner is not None and owner is not self) or self._face.faults.strikes("in-use", "rtde"):
                types.append("IN_USE")
            else:
                types.append(IN[name])
        sound = bool(names) and not {"NOT_FOUND", "IN_USE"} & set(types) and len(self._inputs) < RECIPES
        number = 0
        if sound:
            number = len(self._inputs) + 1
            self._inputs[number] = Unpacker(names)
            self._face.claimed |= dict.fromkeys(names, self)
        self._reply(INPUTS, bytes([number]) + ",".join(types).encode())

    def _data(self, payload: bytes) -> None:
        recipe = self._inputs.get(payload[0]) if payload else None
        if recipe is None:
            self._send_text("input package for a recipe that was not set up")
            return
        try:
            values: Mapping[str, object] = recipe.values(payload[1:])
        except ValueError as error:
            self._send_text(f"input package: {error}")
            return
        self._face.controller.feed(values)

    def _reply(self, kind: int, payload: bytes) -> None:
        if len(payload) + 3 > LARGEST_PACKAGE:
            raise ProtocolEnd
        self._link.send(struct.pack(">HB", len(payload) + 3, kind) + payload)

    def _send_text(self, text: str) -> None:
        message, source, level = text.encode()[:255], b"RTDE", 2
        if self._version == 2:
            body = bytes([len(message)]) + message + bytes([len(source)]) + source + bytes([level])
        else:
            body = bytes([level]) + message
        self._reply(TEXT, body)


def _names(payload: bytes) -> list[str]:
    # Some client ends its list with a comma.
    return [name.strip() for name in payload.decode("ascii", "replace").split(",") if name.strip()]
