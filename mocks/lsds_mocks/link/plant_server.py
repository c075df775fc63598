"""`lsds mock plant`: the physics of one cell in a separate process, in real time, shared by all its wire mocks."""

from __future__ import annotations

import contextlib
import errno
import os
import select
import socket
import struct
import threading
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.contracts.plant_links import FingerState, Load, Scene
from lsds.errors import ConfigError, ConfigIssue, ConnectFailed
from lsds_mocks.cell.build import make_cell
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.link.packets import (
    ASK,
    DRIVE,
    FOLLOW,
    LARGEST_MESSAGE,
    WANT,
    Kind,
    Want,
    pack_fingers,
    pack_gel,
    pack_load,
    pack_scene,
    pack_truth,
)
from lsds_mocks.link.private_socket import owner_only, same_user
from lsds_mocks.plant.followed import FollowedAxis
from lsds_mocks.plant.physics import FINGERS

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds_mocks.cell.cell import SimulatedCell
    from lsds_mocks.cell.touch import GelTouch
    from lsds_mocks.link.plant_options import PlantOptions
    from lsds_mocks.plant.physics import Physics
    from lsds_mocks.plant.plant import Plant

NAME = "plant"
LAG_NS = 8_000_000
"""Delay of the physics behind the present, long enough for messages of the arm's process to arrive."""

LATEST_STEP_NS = 200_000_000
"""Delay of a step above which the schedule restarts at the present, ns; chosen."""
LATE_NS = 20_000_000
"""Age up to which a request for the gel's state is still answered, ns; chosen."""
PLANT_STATES_KEPT = 512
"""Number of the newest scenes that the plant keeps for requests; chosen."""
NO_TIME_NS = 2**62
"""Instant of the next exposure when none is requested, ns: later than any clock value."""


class _Client:
    def __init__(self, link: socket.socket) -> None:
        self.link = link
        self.want = Want.NOTHING

    def send(self, packet: bytes) -> None:
        # A client that does not read loses packets but does not delay others.
        with contextlib.suppress(OSError):
            self.link.send(packet)


class _Exposures:
    """A `Camera` of the cell that exposes when a client has asked for it."""

    def __init__(self) -> None:
        self._asked: list[tuple[int, _Client]] = []

    @property
    def next_exposure_ns(self) -> int:
        """The earliest instant asked for."""
        return min((t_ns for t_ns, _ in self._asked), default=NO_TIME_NS)

    def ask(self, t_ns: int, client: _Client) -> None:
        """Expose at an instant."""
        self._asked.append((t_ns, client))

    def expose(self, touch: GelTouch) -> None:
        """Answer all requests for the earliest instant."""
        now = self.next_exposure_ns
        for t_ns, client in self._asked:
            if t_ns == now:
                client.send(pack_gel(t_ns, touch.state))
        self._asked = [(t_ns, client) for t_ns, client in self._asked if t_ns != now]


class PlantMock:
    """A `WireMock` without a device: the plant that the mocks of one cell share."""

    def __init__(self, options: PlantOptions, context: BuildContext) -> None:
        self.options = options
        self._options = CellOptions(**{name: getattr(options, name) for name in CellOptions.model_fields})
        self._context = context
        self._clock = context.clock
        self._listener: socket.socket | None = None
        self._clients: dict[int, _Client] = {}
        self._exposures = _Exposures()
        self._scenes: deque[Scene] = deque(maxlen=PLANT_STATES_KEPT)
        self._scene_asked: list[tuple[int, _Client]] = []

    def start(self) -> Mapping[str, str]:
        """Make the plant and listen. Raises ConnectFailed if another plant uses the socket."""
        path = Path(self.options.socket)
        self._make_room(path)
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            with owner_only():
                listener.bind(str(path))
            listener.listen(16)
        except OSError as error:
            listener.close()
            remedy = "choose another path: --socket PATH"
            raise ConnectFailed(NAME, f"cannot listen on '{path}': {error.strerror}", remedy=remedy) from error
        listener.setblocking(False)
        self._listener = listener
        self._set_up()
        return {"plant": str(path)}

    def serve(self, stop: threading.Event) -> None:
        """Step the physics in real time, a little behind it, until `stop` is set."""
        step_ns = self._cell.step_ns
        poll = select.poll()
        assert self._listener is not None
        poll.register(self._listener, select.POLLIN)
        next_ns = self._clock.now()
        while not stop.is_set():
            self._clock.sleep_until(next_ns)
            if self._clock.now() - next_ns > LATEST_STEP_NS:
                next_ns = self._clock.now()
            next_ns += step_ns
            for descriptor, _ in poll.poll(0):
                if descriptor == self._listener.fileno():
                    self._accept(poll)
                else:
                    self._read(descriptor, poll)
            self._cell.advance(self._clock.now() - LAG_NS)
            self._publish(self._cell)

    def inject(self, fault: Mapping[str, Any]) -> None:
        """Raise ConfigError: the plant has no faults."""
        raise ConfigError(NAME, [ConfigIssue("fault.kind", f"'{fault.get('kind')}': the plant has no faults")])

    def close(self) -> None:
        """Close and remove the socket."""
        for client in self._clients.values():
            client.link.close()
        self._clients.clear()
        if self._listener is not None:
            self._listener.close()
            self._listener = None
            with contextlib.suppress(OSError):
                os.unlink(self.options.socket)

    # -- inside -------------------------------------------------------------------------------------------

    def _set_up(self) -> None:
        """Put the object upright under the open fingers, as an operator does between two runs.

        The arm's height counts from its present position.
        """
        self._cell = make_cell(self._options, self._context)
        plant = self._cell.plant
        self._axis = FollowedAxis(plant.parameters.grip_height_m, self._cell.t_ns)
        # The same interface as `ArmAxis`: the plant needs only position and velocity.
        plant.arm = self._axis  # type: ignore[assignment]
        plant.fingers.aperture_m = plant.fingers.target_m = self.options.aperture_mm * 1e-3
        self._cell.watch(self._exposures)

    def _make_room(self, path: Path) -> None:
        """Remove the socket of an earlier plant. Raises ConnectFailed if that plant still runs."""
        if not path.exists():
            return
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
            outcome = probe.connect_ex(str(path))
        if outcome == errno.ECONNREFUSED:
            path.unlink(missing_ok=True)
        elif outcome == 0:
            raise ConnectFailed(NAME, f"another plant serves at '{path}'", remedy="end it, or choose another path")

    def _accept(self, poll: select.poll) -> None:
        assert self._listener is not None
        try:
            link, _ = self._listener.accept()
        except OSError:
            return
        if not same_user(link):
            link.close()
            return
        link.setblocking(False)
        link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 20)
        self._clients[link.fileno()] = _Client(link)
        poll.register(link, select.POLLIN)

    def _read(self, descriptor: int, poll: select.poll) -> None:
        client = self._clients[descriptor]
        while True:
            try:
                packet = client.link.recv(LARGEST_MESSAGE)
            except BlockingIOError:
                return
            except OSError:
                packet = b""
            if not packet:
                poll.unregister(descriptor)
                self._clients.pop(descriptor).link.close()
                return
            try:
                self._take(packet, client)
            except (struct.error, ValueError):
                # Not a packet of this protocol; disconnect this client.
                poll.unregister(descriptor)
                self._clients.pop(descriptor).link.close()
                return

    def _take(self, packet: bytes, client: _Client) -> None:
        kind = packet[0]
        if kind == Kind.FOLLOW:
            _, t_ns, height, velocity = FOLLOW.unpack(packet)
            self._axis.add_sample(t_ns, height, velocity)
        elif kind == Kind.DRIVE:
            self._cell.post(self._cell.t_ns, "fingers", _Drive(*DRIVE.unpack(packet)[1:]))
        elif kind == Kind.HOLD:
            self._cell.post(self._cell.t_ns, "fingers", _hold)
        elif kind == Kind.ASK_GEL:
            _, t_ns = ASK.unpack(packet)
            if t_ns <= self._cell.t_ns - LATE_NS:
                client.send(pack_gel(t_ns, None))
            elif t_ns <= self._cell.t_ns:
                # The request is slightly late; the present state of the gel is the nearest one available.
                client.send(pack_gel(t_ns, self._cell.gel_state()))
            else:
                self._exposures.ask(t_ns, client)
        elif kind == Kind.ASK_SCENE:
            self._scene_asked.append((ASK.unpack(packet)[1], client))
        elif kind == Kind.RESET:
            self._set_up()
            client.send(packet)
            self._send_state(client, self._cell)
        elif kind == Kind.ASK_OPTIONS:
            client.send(bytes([Kind.OPTIONS]) + self._options.model_dump_json().encode())
        elif kind == Kind.WANT:
            client.want = Want(WANT.unpack(packet)[1])
            self._send_state(client, self._cell)

    def _publish(self, cell: SimulatedCell[Plant]) -> None:
        plant = cell.plant
        self._scenes.append(Scene(cell.t_ns, plant.arm.position_m, plant.object_height_m))
        for client in list(self._clients.values()):
            if client.want is not Want.NOTHING:
                self._send_state(client, cell)
        for t_ns, client in self._scene_asked[:]:
            if t_ns <= cell.t_ns:
                self._scene_asked.remove((t_ns, client))
                client.send(pack_scene(t_ns, self._scene(t_ns)))

    def _send_state(self, client: _Client, cell: SimulatedCell[Plant]) -> None:
        plant = cell.plant
        if client.want is Want.FINGERS:
            drive = plant.fingers
            state = (drive.aperture_m, drive.target_m, drive.moving, drive.stalled, plant.normal_n)
            client.send(pack_fingers(FingerState(cell.t_ns, *state)))
        elif client.want is Want.LOAD:
            client.send(pack_load(Load(cell.t_ns, FINGERS * abs(plant.tangential_n))))
        elif client.want is Want.TRUTH:
            client.send(pack_truth(cell.truth()))

    def _scene(self, t_ns: int) -> Scene | None:
        after: Scene | None = None
        for scene in reversed(self._scenes):
            if scene.t_ns <= t_ns:
                if after is None:
                    return scene._replace(t_ns=t_ns)
                share = (t_ns - scene.t_ns) / (after.t_ns - scene.t_ns)
                arm = scene.arm_m + share * (after.arm_m - scene.arm_m)
                return Scene(t_ns, arm, scene.object_m + share * (after.object_m - scene.object_m))
            after = scene
        return None


class _Drive:
    """Action that moves the fingers to an aperture at a speed with a force limit."""

    def __init__(self, target_m: float, speed_m_s: float, limit_n: float) -> None:
        self._order = (target_m, speed_m_s, limit_n)

    def __call__(self, plant: Physics) -> None:
        plant.drive_fingers(*self._order)


def _hold(plant: Physics) -> None:
    plant.hold_fingers()
