"""Devices with a mistake in their life cycle, in resources that they leak, or in the time of their calls."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import threading
import time
from functools import partial

from catching import LEFT, caught_device
from honest_devices import HonestArm, HonestGripper, HonestPoses, HonestSensor

from lsds.contracts import Lifecycle
from lsds.testing import latency, leaks, lifecycle, unplugged
from lsds.testing.machine import check_any_order_of_calls

SLOW_S = 0.15
RELEASES = leaks.check_close_releases_everything
QUICK = latency.check_calls_return_quickly


@caught_device("sensor", lifecycle.check_constructing_does_no_io, "started a thread")
class StartsAThread(HonestSensor):
    def __init__(self, options, context):
        super().__init__(options, context)
        end = threading.Event()
        LEFT.append(end.set)
        threading.Thread(target=end.wait, daemon=True).start()


@caught_device("sensor", lifecycle.check_constructing_does_no_io, "the constructor accessed")
class OpensADevice(HonestSensor):
    def __init__(self, options, context):
        super().__init__(options, context)
        with open("/dev/null"):
            pass


@caught_device("gripper", lifecycle.check_stops_from_any_state_and_thread, r"stop\(\) closed a device")
class StopCloses(HonestGripper):
    def stop(self):
        with self.guard.closing():
            pass


@caught_device("arm", lifecycle.check_stops_from_any_state_and_thread, r"stop\(\) raised")
class StopNeedsArming(HonestArm):
    def stop(self):
        self.guard.require_armed("stop")


@caught_device("sensor", lifecycle.check_connects_once, r"a second connect\(\) did not raise LifecycleError")
class ConnectsTwice(HonestSensor):
    def connect(self):
        if self.lifecycle is Lifecycle.NEW:
            super().connect()


@caught_device("pose_source", lifecycle.check_closed_is_final, r"read\(\) of a closed device did not raise")
class ReadsWhenClosed(HonestPoses):
    def read(self):
        return None if self.lifecycle is Lifecycle.CLOSED else super().read()


@caught_device("sensor", lifecycle.check_refuses_before_connect, r"read\(\) before connect\(\) raised AttributeError")
class FailsBeforeConnect(HonestSensor):
    def read(self):
        if self.lifecycle is Lifecycle.NEW:
            raise AttributeError("no camera")
        return super().read()


@caught_device("gripper", lifecycle.check_walks_through_its_life, "the device is armed, expected connected")
class StaysArmed(HonestGripper):
    def disarm(self):
        self.stop()


@caught_device("pose_source", lifecycle.check_reads_soon_after_connect, "no sample came within")
class NeverReads(HonestPoses):
    def read(self):
        from lsds.errors import StaleData

        self.guard.require_readable()
        raise StaleData("honest", "nothing has come", remedy="wait")


@caught_device("gripper", check_any_order_of_calls, "ValueError|expected")
class ClosesOnlyOnce(HonestGripper):
    def close(self):
        if self.lifecycle is Lifecycle.CLOSED:
            raise ValueError("closed already")
        super().close()


@caught_device("sensor", RELEASES, "still holds file descriptor .*socket")
class LeaksASocket(HonestSensor):
    def connect(self):
        super().connect()
        self.socket = socket.socket()
        LEFT.append(self.socket.close)


@caught_device("gripper", RELEASES, "still holds file descriptor")
class LeaksAFile(HonestGripper):
    def connect(self):
        super().connect()
        number = os.open("/dev/null", os.O_RDONLY)
        LEFT.append(partial(os.close, number))


@caught_device("sensor", RELEASES, "still holds thread left-over")
class LeaksAThread(HonestSensor):
    def connect(self):
        super().connect()
        end = threading.Event()
        LEFT.append(end.set)
        threading.Thread(target=end.wait, name="left-over", daemon=True).start()


@caught_device("arm", RELEASES, "still holds .*child process")
class LeaksAChild(HonestArm):
    def connect(self):
        super().connect()
        child = subprocess.Popen(["sleep", "60"])
        LEFT.extend((child.kill, child.wait))


@caught_device("sensor", latency.check_works_outside_the_main_thread, "signal only works in main thread")
class NeedsTheMainThread(HonestSensor):
    def connect(self):
        signal.signal(signal.SIGUSR2, signal.SIG_DFL)
        super().connect()


@caught_device("arm", latency.check_works_outside_the_main_thread, r"close\(\) in a thread raised")
class ClosesInItsThreadOnly(HonestArm):
    def connect(self):
        self.thread = threading.get_ident()
        super().connect()

    def close(self):
        if getattr(self, "thread", 0) not in (0, threading.get_ident()):
            raise RuntimeError("not my thread")
        super().close()


@caught_device("sensor", QUICK, r"read\(\) takes 0.1\d s")
class ReadsSlowly(HonestSensor):
    def read(self):
        time.sleep(SLOW_S)
        return super().read()


@caught_device("sensor", QUICK, r"read\(\) let 0.04 s of simulated time pass")
class WaitsForAFrame(HonestSensor):
    def read(self):
        self.clock.sleep_until(self.clock.now() + 40_000_000)
        return super().read()


@caught_device("gripper", QUICK, r"command\(\) takes 0.1\d s")
class CommandsSlowly(HonestGripper):
    def command(self, command):
        time.sleep(SLOW_S)
        return super().command(command)


@caught_device("gripper", QUICK, r"command\(\) let .* of simulated time pass")
class WaitsForTheMotion(HonestGripper):
    def command(self, command):
        sent = super().command(command)
        self.clock.sleep_until(self.clock.now() + 500_000_000)
        return sent


@caught_device("arm", QUICK, r"stop\(\) takes 0.1\d s")
class StopsSlowly(HonestArm):
    def stop(self):
        time.sleep(SLOW_S)
        super().stop()


@caught_device("sensor", unplugged.check_unplugged_device_is_reported, "raised OSError")
class ForeignErrorWhenUnplugged(HonestSensor):
    def require_line(self):
        if self.unplugged:
            raise OSError("device disconnected")


@caught_device("gripper", unplugged.check_unplugged_device_is_reported, r"read\(\) still returns samples")
class LastStateForEver(HonestGripper):
    def read(self):
        if not self.unplugged:
            self.last = super().read()
        return self.last


@caught_device("arm", unplugged.check_unplugged_device_is_reported, r"close\(\) of an unplugged device raised")
class ClosesOverTheLine(HonestArm):
    def close(self):
        if self.unplugged:
            raise OSError("no route to host")
        super().close()
