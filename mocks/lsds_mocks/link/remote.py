"""Links to a plant in another process, over a Unix socket that preserves packet boundaries."""

from __future__ import annotations

import contextlib
import select
import socket
from collections.abc import Callable
from typing import TypeVar

from lsds.clock import seconds
from lsds.contracts import CellTruth
from lsds.contracts.plant_links import FingerState, Load, Scene
from lsds.errors import ConnectFailed, StaleData
from lsds_mocks.link.packets import (
    ASK,
    DRIVE,
    FOLLOW,
    LARGEST_MESSAGE,
    WANT,
    Kind,
    Want,
    unpack_fingers,
    unpack_load,
    unpack_scene,
    unpack_truth,
)
from lsds_mocks.link.private_socket import same_user

T = TypeVar("T")

GREETING_S = 2.0
"""Time limit for the connection to a plant, its greeting and its reset, s; chosen."""
PACKET_ANSWER_S = 0.3
"""Time limit for a plant's answer to a request, s; chosen."""


class NoPlant(ConnectFailed):
    """No plant listens at the address."""


class PlantSocket:
    """One client's connection. Reading does not block unless a timeout is given."""

    def __init__(self, address: str, want: Want) -> None:
        self._address = address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._socket.settimeout(GREETING_S)
            self._socket.connect(address)
        except OSError as error:
            self._socket.close()
            remedy = "start it first: lsds mock plant, or lsds mock rig RIG.toml for a whole rig"
            raise NoPlant("shared plant", f"no plant at '{address}': {error.strerror}", remedy=remedy) from error
        if not same_user(self._socket):
            self._socket.close()
            problem = f"the process that listens at '{address}' belongs to another user"
            raise ConnectFailed("shared plant", problem, remedy="choose another path: cell.wire.socket")
        self._socket.setblocking(False)
        self.send(WANT.pack(Kind.WANT, want))

    def send(self, packet: bytes) -> None:
        """Send without waiting; a packet is dropped if the plant does not read, so that it cannot block a device."""
        with contextlib.suppress(OSError):
            self._socket.send(packet)

    def newest(self) -> bytes | None:
        """Return the newest packet that has arrived since the last call, or None."""
        found = None
        while (packet := self.receive(0.0)) is not None:
            found = packet
        return found

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next packet; None if none arrives in time or the plant has ended."""
        try:
            if timeout_s > 0 and not select.select([self._socket], [], [], timeout_s)[0]:
                return None
            return self._socket.recv(LARGEST_MESSAGE) or None
        except OSError:
            return None

    def first(self) -> bytes:
        """Return the packet that greets a new client. Raises ConnectFailed if none arrives."""
        packet = self.receive(GREETING_S)
        if packet is None:
            raise ConnectFailed("shared plant", f"no greeting from '{self._address}' within {GREETING_S:g} s")
        return packet

    def ask(self, kind: Kind, t_ns: int, unpack: Callable[[bytes], tuple[int, T]]) -> T | None:
        """Request the state at an instant and wait until the physics has passed it; None without an answer."""
        self.send(ASK.pack(kind, t_ns))
        while (packet := self.receive(PACKET_ANSWER_S)) is not None:
            asked_ns, answer = unpack(packet)
            if asked_ns == t_ns:
                return answer
        return None

    def close(self) -> None:
        """Close."""
        self._socket.close()


class RemoteFingers:
    """A `FingerLink`."""

    def __init__(self, address: str) -> None:
        self._plant = PlantSocket(address, Want.FINGERS)
        self._last = unpack_fingers(self._plant.first())

    def drive(self, target_m: float, speed_m_s: float, limit_n: float) -> None:
        """Go to an aperture."""
        self._plant.send(DRIVE.pack(Kind.DRIVE, target_m, speed_m_s, limit_n))
        self._last = self._last._replace(target_m=target_m, moving=target_m != self._last.aperture_m, stalled=False)

    def hold(self) -> None:
        """Stay."""
        self._plant.send(bytes([Kind.HOLD]))

    def fingers(self) -> FingerState:
        """Return the newest state."""
        packet = self._plant.newest()
        if packet is not None:
            self._last = unpack_fingers(packet)
        return self._last

    def close(self) -> None:
        """Close."""
        self._plant.close()


class RemoteArm:
    """An `ArmLink`."""

    def __init__(self, address: str) -> None:
        self._plant = PlantSocket(address, Want.LOAD)
        self._last = Load(0, 0.0)

    def follow(self, t_ns: int, height_m: float, velocity_m_s: float) -> None:
        """Send the position of the tool."""
        self._plant.send(FOLLOW.pack(Kind.FOLLOW, t_ns, height_m, velocity_m_s))

    def load(self) -> Load:
        """Return the newest load."""
        packet = self._plant.newest()
        if packet is not None:
            self._last = unpack_load(packet)
        return self._last

    def close(self) -> None:
        """Close."""
        self._plant.close()


class RemoteScene:
    """A `SceneLink`."""

    def __init__(self, address: str) -> None:
        self._plant = PlantSocket(address, Want.NOTHING)

    def scene(self, t_ns: int) -> Scene | None:
        """Request the scene at an instant; wait until the physics has passed it."""
        return self._plant.ask(Kind.ASK_SCENE, t_ns, unpack_scene)

    def close(self) -> None:
        """Close."""
        self._plant.close()


class RemoteTruth:
    """The plant's truth, for summaries of simulated runs."""

    def __init__(self, address: str) -> None:
        self._plant = PlantSocket(address, Want.TRUTH)
        self._last = unpack_truth(self._plant.first())

    def reset(self) -> None:
        """Put the object back and open the fingers. Raises ConnectFailed if the plant does not answer."""
        self._plant.send(bytes([Kind.RESET]))
        done = False
        while (packet := self._plant.receive(GREETING_S)) is not None:
            if done:
                self._last = unpack_truth(packet)
                return
            # Packets that arrive before the echo still belong to the scene before the reset.
            done = packet[0] == Kind.RESET
        raise ConnectFailed("shared plant", "does not put its object back", remedy="end the mocks and start them again")

    def truth(self, now_ns: int, stale_s: float) -> CellTruth:
        """Return the newest truth. Raises StaleData if it is older than `stale_s`."""
        packet = self._plant.newest()
        if packet is not None:
            self._last = unpack_truth(packet)
        age_s = seconds(now_ns - self._last.t_ns)
        if age_s > stale_s:
            raise StaleData("shared plant", f"its truth is {age_s:.2f} s old", remedy="check that it still runs")
        return self._last

    def close(self) -> None:
        """Close."""
        self._plant.close()
