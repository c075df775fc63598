"""The gripper through the string server of Robotiq's URCap on the robot's controller (TCP 63352)."""

from __future__ import annotations

import contextlib
import socket

from lsds.clock import Clock, nanoseconds, seconds
from lsds.errors import ConnectFailed, DeviceFault, DeviceTimeout, ProtocolFault
from lsds_drivers.robotiq.modbus import open_socket
from lsds_drivers.robotiq.patience import Patience
from lsds_drivers.robotiq.registers import (
    ACTIVATE,
    GO_TO,
    RELEASE,
    RELEASE_OPENING,
    Activation,
    Detection,
    Motion,
    Status,
)

_NAMES = ("ACT", "GTO", "STA", "OBJ", "FLT", "PRE", "POS")
_ASK = "".join(f"GET {name}\n" for name in _NAMES).encode()
_LIMITS = {"ACT": 1, "GTO": 1, "STA": 3, "OBJ": 3}
_ACK = b"ack"
_LONGEST_ANSWER = 1024
"""Maximum length of an answer, bytes; chosen."""
_LEAST_URCAP_WAIT_S = 0.04
"""Minimum wait for an answer (s); chosen."""


class UrcapTransport:
    """A `Transport` of GET and SET lines. Any failure closes it, because a new connection has no late answers."""

    def __init__(self, device: str, host: str, port: int, timeout_s: float, clock: Clock) -> None:
        self._device = device
        self._address = (host, port)
        self._patience = Patience(_LEAST_URCAP_WAIT_S, timeout_s)
        self._clock = clock
        self._socket: socket.socket | None = None
        self._asked_ns = 0

    @property
    def is_open(self) -> bool:
        """Whether requests can be made."""
        return self._socket is not None

    @property
    def waited_s(self) -> float:
        """Time (s) since the request of the last answer."""
        return seconds(self._clock.now() - self._asked_ns)

    def open(self, timeout_s: float) -> None:
        """Connect. Raises ConnectFailed with a remedy."""
        self.close()
        self._socket = open_socket(self._device, self._address, timeout_s)

    def close(self) -> None:
        """Close the socket."""
        connection, self._socket = self._socket, None
        if connection is not None:
            with contextlib.suppress(OSError):
                connection.close()

    def read(self) -> Status:
        """Request all variables in one line."""
        values = self._values(self._exchange(_ASK, lines=len(_NAMES)))
        return Status(
            activated=bool(values["ACT"]),
            going=bool(values["GTO"]),
            activation=Activation(values["STA"]),
            detection=Detection(values["OBJ"]),
            fault=values["FLT"] & 0x0F,
            controller_fault=values["FLT"] >> 4,
            echo=values["PRE"],
            position=values["POS"],
            current=0,
        )

    def write(self, action: int, motion: Motion | None) -> None:
        """Set all changed variables in one line, so that they take effect together."""
        words = "SET"
        if motion is not None:
            words += f" POS {motion.position} SPE {motion.speed} FOR {motion.force}"
        if action & RELEASE:
            words += f" ARD {int(bool(action & RELEASE_OPENING))}"
        bits = {"ACT": ACTIVATE, "GTO": GO_TO, "ATR": RELEASE}
        words += "".join(f" {name} {int(bool(action & bit))}" for name, bit in bits.items())
        self._exchange(f"{words}\n".encode(), lines=0)

    # -- inside -------------------------------------------------------------------------------------------

    def _exchange(self, request: bytes, lines: int) -> bytes:
        """Send a request; return its answer of `lines` lines, or an acknowledgement if `lines` is 0."""
        connection = self._socket
        if connection is None:
            raise self._lost()
        answer = b""
        wait_s = self._patience.wait_s
        began = self._asked_ns = self._clock.now()
        deadline = began + nanoseconds(wait_s)
        try:
            _drain(connection)
            connection.settimeout(wait_s)
            connection.sendall(request)
            while not (answer.count(b"\n") >= lines if lines else answer.startswith(_ACK)):
                left = seconds(deadline - self._clock.now())
                if left <= 0 or len(answer) > _LONGEST_ANSWER:
                    break
                if not lines and not _ACK.startswith(answer[: len(_ACK)]):
                    break
                connection.settimeout(left)
                received = connection.recv(4096)
                if not received:
                    self.close()
                    raise self._lost()
                answer += received
        except TimeoutError:
            pass
        except OSError as error:
            self.close()
            raise self._lost() from error
        complete = answer.count(b"\n") == lines and answer.endswith(b"\n") if lines else answer.strip() == _ACK
        if complete:
            self._patience.answered(seconds(self._clock.now() - began))
            return answer
        self._patience.silent()
        self.close()
        if answer:
            raise self._spoilt(answer)
        raise DeviceTimeout(
            self._device,
            f"no answer from {self._address[0]}:{self._address[1]} within {1e3 * wait_s:.0f} ms",
            remedy="is the robot on, and its URCap running?",
        )

    def _values(self, answer: bytes) -> dict[str, int]:
        values: dict[str, int] = {}
        for name, line in zip(_NAMES, answer.decode("ascii", "replace").splitlines(), strict=True):
            words = line.split(" ")
            if len(words) != 2 or words[0] != name:
                self.close()
                raise self._spoilt(answer)
            if words[1] == "?":
                raise DeviceFault(
                    self._device,
                    f"the robot's controller does not report {name}",
                    remedy="release the emergency stop and switch the robot's power on",
                )
            if not words[1].isascii() or not words[1].isdigit() or int(words[1]) > _LIMITS.get(name, 255):
                self.close()
                raise self._spoilt(answer)
            values[name] = int(words[1])
        return values

    def _spoilt(self, answer: bytes) -> ProtocolFault:
        shown = answer[:60].decode("ascii", "backslashreplace")
        return ProtocolFault(
            self._device, f"the string server answered {shown!r}", remedy="does Robotiq's URCap have that port?"
        )

    def _lost(self) -> ConnectFailed:
        return ConnectFailed(
            self._device,
            f"{self._address[0]}:{self._address[1]} has closed the connection",
            remedy="is the robot on, and its URCap running?",
        )


def _drain(connection: socket.socket) -> None:
    """Discard unexpected bytes: a duplicate or a late answer."""
    connection.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        while connection.recv(4096):
            pass
