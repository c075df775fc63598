"""Helpers for the tests of the Robotiq mock and drivers."""

from __future__ import annotations

import contextlib
import gc
import os
import threading

from lsds_mocks.link.alone import LoneFingers
from lsds_mocks.mock_process import MockProcess
from lsds_mocks.wire.robotiq.fingers import clearing
from lsds_mocks.wire.robotiq.machine import RegisterMachine
from lsds_mocks.wire.robotiq.options import RobotiqOptions
from lsds_mocks.wire.robotiq.rtu import Deframer, answer, crc

from lsds.clock import NS_PER_S, VirtualClock, WallClock
from lsds.contracts import BuildContext, GripperCommand
from lsds.registry import PluginHost
from tests.wire.waiting import until

HOST = PluginHost()
CLOCK = WallClock()
ANY_PORTS = {"tcp_port": 0, "urcap_port": 0}


class Bench:
    """A register machine with its own fingers, on a manual clock."""

    def __init__(self, **options):
        self.options = RobotiqOptions(**options)
        self.clock = VirtualClock(NS_PER_S)
        mm = {"aperture_m": self.options.aperture_mm or self.options.stroke_mm}
        mm |= {"object_m": self.options.object_mm, "hollow_m": self.options.hollow_mm}
        self.fingers = LoneFingers(self.clock, **{k: v if v is None else v * 1e-3 for k, v in mm.items()})
        clear = clearing(self.options, self.fingers)
        self.machine = RegisterMachine(self.options, self.fingers, self.clock.now(), clear)
        self._deframer = Deframer()

    def ask(self, request):
        """Answers to bytes in hex, in hex."""
        frames = self._deframer.feed(bytes.fromhex(request), self.clock.now())
        answers = [answer(frame, self.options.slave, self.machine, self.clock.now()) for frame in frames]
        return " ".join(a.hex(" ").upper() for a in answers if a is not None)

    def wait(self, s, step_s=0.005):
        end = self.clock.now() + round(s * NS_PER_S)
        while self.clock.now() < end:
            self.clock.sleep_until(min(end, self.clock.now() + round(step_s * NS_PER_S)))
            self.machine.step(self.clock.now())

    def write(self, action, position=None, speed=255, force=0):
        block = bytes([action]) if position is None else bytes([action, 0, 0, position, speed, force])
        self.machine.write(0, block, self.clock.now())

    @property
    def status(self):
        return self.machine.status(self.clock.now())

    @property
    def sta(self):
        return self.status[0] >> 4 & 3

    @property
    def obj(self):
        return self.status[0] >> 6

    @property
    def flt(self):
        return self.status[2]

    @property
    def tick(self):
        return self.status[4]


def framed(text):
    body = bytes.fromhex(text)
    return (body + crc(body)).hex(" ").upper()


def serving(folder, name="hand-e", **options):
    """A mock in its own process, on a link in a folder."""
    return MockProcess(name, {"pty": str(folder / "gripper.tty"), **ANY_PORTS, **options})


DRIVERS = ("hand-e", "hand-e-tcp", "robotiq-2f", "hand-e-urcap")
FACES = {"hand-e": "pty", "hand-e-tcp": "tcp", "robotiq-2f": "pty", "hand-e-urcap": "urcap"}


def options_for(driver, mock):
    """The options of a driver on a running mock."""
    if driver == "hand-e-urcap":
        host, port = mock.addresses["urcap"].split(":")
        return {"host": host, "port": int(port)}
    return {"port": mock.addresses[FACES[driver]]}


def build(driver, options, clock=CLOCK):
    return HOST.build("gripper", driver.removesuffix("-tcp"), options, BuildContext(clock))


def to(aperture_m, speed_m_s=0.15, force_n=30.0, within_s=0.5):
    return GripperCommand(aperture_m, speed_m_s, force_n, CLOCK.now() + round(within_s * NS_PER_S))


def descriptors():
    """Return the target of each open descriptor of this process."""
    found = {}
    for name in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):
            found[name] = os.readlink(f"/proc/self/fd/{name}")
    return found


@contextlib.contextmanager
def nothing_left():
    """Fail where a thread or a descriptor is left behind."""
    threads, fds = set(threading.enumerate()), descriptors()
    yield
    still = until(lambda: set(threading.enumerate()) <= threads, 2)
    assert still, f"left behind: {[thread.name for thread in set(threading.enumerate()) - threads]}"
    gc.collect()
    left = descriptors()
    assert len(left) <= len(fds), f"left behind: {[left[name] for name in left.keys() - fds.keys()]}"
