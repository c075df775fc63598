"""`lsds mock ur5e`: the controller behind all its ports, on one thread that wakes 500 times a second."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import math
import os
import sys
import threading
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from lsds.errors import DeviceError
from lsds_mocks.link.remote import RemoteArm
from lsds_mocks.wire.address import require_loopback
from lsds_mocks.wire.faults import MESSAGE_FAULTS, Fault, FaultInjector, FaultKind
from lsds_mocks.wire.journal import History, Journal
from lsds_mocks.wire.serving_thread import ServingThread
from lsds_mocks.wire.ur.controller import Controller
from lsds_mocks.wire.ur.dashboard import DashboardSession
from lsds_mocks.wire.ur.environment import Environment
from lsds_mocks.wire.ur.functions import Library
from lsds_mocks.wire.ur.memory import MemoryWatch, give_back
from lsds_mocks.wire.ur.net import Network
from lsds_mocks.wire.ur.pendant import Pendant
from lsds_mocks.wire.ur.primary import StateFace
from lsds_mocks.wire.ur.realtime import RealtimeFace
from lsds_mocks.wire.ur.rtde import RtdeFace
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.uploads import Uploads

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds.contracts.wire import ReceivedFrame
    from lsds_mocks.wire.ur.options import UrOptions

CYCLE_STEP_NS = 2_000_000
"""Control cycle of an e-Series arm (ns): 500 Hz."""
LATEST_CYCLE_NS = 1_000_000_000
"""Delay up to which a late loop catches up, so that no package is lost (ns). After a longer delay, which means that the
process was suspended, the loop continues from the present."""

FACES = (
    *("dashboard", "rtde", "primary", "primary-read-only", "secondary", "secondary-read-only"),
    *("real-time", "real-time-read-only"),
)
WRITABLE = ("primary", "secondary", "real-time")
"""Faces that accept scripts in remote control; their connections end when local control begins."""
KNOWS: dict[FaultKind, tuple[str, ...]] = {
    **dict.fromkeys(MESSAGE_FAULTS, FACES),
    "freeze": (),
    "disconnect": (),
    "busy": FACES,
    "in-use": ("rtde",),
    "delayed-ack": FACES,
    "protective-stop": (),
    "emergency-stop": (),
}
CYCLES_PER_HISTORY_STATE = 5
"""Number of control cycles from one state of the arm in the history to the next: 10 ms."""
_PRIORITY = 20
"""Real-time priority of the loop under SCHED_FIFO, 1 to 99; chosen."""
_SWITCH_S = 100e-6
"""Interval after which the interpreter offers its lock to another thread, s; chosen."""
_PR_SET_TIMERSLACK = 29
"""Option of `prctl` that sets the timer slack of a thread (linux/prctl.h)."""


class MockUr:
    """A `WireMock` of an e-Series arm."""

    def __init__(self, options: UrOptions, context: BuildContext) -> None:
        self.options = options
        require_loopback(options.model, options.host)
        self._clock = context.clock
        self._faults = FaultInjector(options.model, options.faults, KNOWS, seed=context.seed, clock=context.clock)
        self._journal = Journal(self._faults, context.clock)
        self._history = History()
        self._serving = ServingThread(options.model)
        self._network: Network | None = None
        self._uploads = Uploads(context.clock, options.socket_ports)
        self.controller: Controller | None = None
        self._pendant: Pendant | None = None

    def start(self) -> Mapping[str, str]:
        """Bind all ports. Raises ConnectFailed if one is in use."""
        link = RemoteArm(self.options.cell) if self.options.cell else None
        environment = Environment(self.options.floor_m, link, self._clock)
        controller = self.controller = Controller(self.options, environment, Library)
        pendant = self._pendant = Pendant(controller, self._uploads)
        network = self._network = Network(self.options.host, self._faults, self._clock, self._journal)
        self._rtde = RtdeFace(controller, self._faults)
        scripts = pendant.script
        self._states = [
            StateFace(controller, scripts, all_messages=True),
            StateFace(controller, None, all_messages=True),
            StateFace(controller, scripts, all_messages=False),
            StateFace(controller, None, all_messages=False),
        ]
        self._streams = [RealtimeFace(controller, scripts), RealtimeFace(controller, None)]
        ports: dict[str, tuple[int, Any]] = {
            "dashboard": (29999, lambda link: DashboardSession(pendant, link)),
            "primary": (30001, self._states[0].open),
            "primary-read-only": (30011, self._states[1].open),
            "secondary": (30002, self._states[2].open),
            "secondary-read-only": (30012, self._states[3].open),
            "real-time": (30003, self._streams[0].open),
            "real-time-read-only": (30013, self._streams[1].open),
            "rtde": (30004, self._rtde.open),
        }
        for face, (port, open_session) in ports.items():
            network.listen(face, port, open_session)
        self._uploads.start()
        return {face: f"{self.options.host}:{port}" for face, (port, _) in ports.items()}

    def serve(self, stop: threading.Event) -> None:
        """Run control cycles until `stop` is set."""
        network, controller, pendant = self._network, self.controller, self._pendant
        assert network is not None
        assert controller is not None
        assert pendant is not None
        _be_punctual()
        memory = MemoryWatch()
        next_ns, remote, handovers = self._clock.now(), controller.remote, controller.handovers
        with self._serving.serving():
            while not stop.is_set():
                self._clock.sleep_until(next_ns)
                if self._clock.now() - next_ns > LATEST_CYCLE_NS:
                    next_ns = self._clock.now()
                next_ns += CYCLE_STEP_NS
                self._serving.turn()
                if self._strike(network, controller):
                    continue
                network.poll()
                pendant.poll()
                controller.cycle()
                if remote and controller.handovers != handovers:
                    # Local control has begun, even if it has ended again.
                    network.end(WRITABLE)
                remote, handovers = controller.remote, controller.handovers
                if pendant.ends_s is not None and controller.time_s >= pendant.ends_s:
                    network.shut()
                    pendant.ends_s = None
                if controller.step_number % CYCLES_PER_HISTORY_STATE == 0:
                    self._history.add(self._clock.now(), truth_of(controller))
                if memory.exceeded(controller.busy):
                    controller.fail_programs(ScriptError("runtime_error: out of memory"))
                    give_back()
                messages = list(controller.messages)
                controller.messages.clear()
                self._rtde.publish()
                for stream in self._streams:
                    stream.publish()
                for state in self._states:
                    state.publish(messages)

    def inject(self, fault: Mapping[str, Any]) -> None:
        """Begin a fault. Raises ConfigError for a fault that the arm does not support."""
        self._faults.add(fault)
        # The second call returns in a later cycle than the first: in between, the fault has struck.
        for _ in range(2):
            self._serving.run(lambda: None)

    def end_fault(self, name: str) -> None:
        """End the faults of a name; ports open again. A protective stop lasts until it is unlocked."""
        self._serving.run(partial(self._end_fault, name))

    def received(self, since: int) -> Sequence[ReceivedFrame]:
        """Return the dashboard's requests, RTDE packages and programs with a number of at least `since`."""
        return self._journal.received(since)

    def truths(self, since_ns: int) -> Sequence[Mapping[str, Any]]:
        """Return the states of the arm since a time. Raises DeviceError before `start`."""
        return self._serving.run(partial(self._truths, since_ns))

    def close(self) -> None:
        """Close everything."""
        self._uploads.close()
        if self._network is not None:
            self._network.close()
        if self.controller is not None:
            self.controller.stop_program()
            self.controller.environment.close()

    def _end_fault(self, name: str) -> None:
        self._faults.end(name)
        # Another disconnect that is still on closes the ports again in the same cycle.
        if self._network is not None:
            self._network.reconnect()

    def _truths(self, since_ns: int) -> Sequence[Mapping[str, Any]]:
        if self.controller is None:
            raise DeviceError(f"mock {self.options.model}", "has not started")
        return self._history.since(since_ns, self._clock.now(), truth_of(self.controller))

    def _strike(self, network: Network, controller: Controller) -> bool:
        """Apply due faults of the whole arm; return whether the controller is frozen in this cycle."""
        if self._faults.quiet:
            controller.press_emergency_stop(pressed=False)
            return False
        if fault := self._faults.strikes("disconnect", ""):
            network.disconnect(_rest(self._faults, fault))
        if self._faults.strikes("protective-stop", ""):
            controller.protective_stop()
        controller.press_emergency_stop(pressed=self._faults.strikes("emergency-stop", "") is not None)
        return self._faults.strikes("freeze", "") is not None


def truth_of(controller: Controller) -> dict[str, Any]:
    """Return the state of an arm: joints (rad), pose and speed of the tool centre point, force on it (N), and modes."""
    return {
        "q_rad": list(controller.arm.q),
        "pose": list(controller.tcp_pose),
        "speed_m_s": math.hypot(*controller.tcp_speed[:3]),
        "force_n": list(controller.tcp_force[:3]),
        "moving": controller.arm.moving,
        "mode": controller.power.mode.name,
        "safety": controller.safety.name,
        "program": controller.runtime_state.name,
    }


def _rest(faults: FaultInjector, fault: Fault) -> float | None:
    return faults.remaining_s(fault)


def _be_punctual() -> None:
    """Request short timer slack and, if permitted, real-time priority; keep the garbage collector and the compiler
    thread from delaying the loop."""
    sys.setswitchinterval(_SWITCH_S)
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    gc.collect()
    gc.freeze()
    gc.disable()
