"""Clients with one planted mistake each, around a Modbus client that works."""

import contextlib
import os
import subprocess
import sys
import time

from examples.clients.pymodbus_hand_e import Client as Works


class Hangs(Works):
    def read(self):
        try:
            return super().read()
        except Exception:
            time.sleep(60)


class Dies(Works):
    def read(self):
        try:
            return super().read()
        except Exception:
            os.abort()


class Leaves(Works):
    def read(self):
        try:
            return super().read()
        except Exception:
            print("giving up")
            os._exit(7)


class Repeats(Works):
    """Returns the last value where it has none."""

    last = None

    def read(self):
        with contextlib.suppress(Exception):
            self.last = super().read()
        return self.last


class Opens(Works):
    """Opens the fingers when an answer is lost."""

    lost = False

    def read(self):
        if self.lost:
            self.lost = False
            self.move(0.045, 0.1)
        try:
            return super().read()
        except Exception:
            self.lost = True
            raise


class IgnoresCommands(Works):
    """Ignores commands after the first error."""

    broken = False

    def move(self, aperture_m, speed_m_s):
        if not self.broken:
            super().move(aperture_m, speed_m_s)

    def read(self):
        try:
            return super().read()
        except Exception:
            self.broken = True
            raise


class IsWrong(Works):
    def read(self):
        return super().read() + 0.004


class Refuses:
    transport = "tcp"

    def __init__(self, address):
        raise ConnectionRefusedError("no such device")


class LeavesAProcess(Refuses):
    """Starts a process that inherits its output and outlives it."""

    def __init__(self, address):
        self.started = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(30)"])

    def read(self):
        return float(self.started.pid)

    def close(self):
        pass
