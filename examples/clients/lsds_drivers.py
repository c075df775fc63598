"""The drivers of lsds under the same trial: `lsds check gripper --client examples.clients.lsds_drivers:HandE`."""

from lsds.clock import WallClock
from lsds.contracts import ArmCommand, BuildContext, GripperCommand, Twist
from lsds.registry import PluginHost

VALID_NS = 200_000_000
OLDEST_NS = 250_000_000
WEAK_N = 20.0


class _Device:
    def __init__(self, kind, name, **options):
        self.clock = WallClock()
        self.device = PluginHost().build(kind, name, options, BuildContext(self.clock))
        self.device.connect()
        if hasattr(self.device, "arm"):
            self.device.arm()

    def fresh(self):
        """The device's state, refused if its time stamp is old."""
        state = self.device.read()
        if self.clock.now() - state.t_ns > OLDEST_NS:
            raise OSError("the state is old")
        return state

    def close(self):
        self.device.close()


class HandE(_Device):
    transport = "tcp"

    def __init__(self, address):
        super().__init__("gripper", "hand-e", port=address)

    def move(self, aperture_m, speed_m_s):
        self.device.command(GripperCommand(aperture_m, speed_m_s, WEAK_N, self.clock.now() + VALID_NS))

    def read(self):
        return self.fresh().aperture_m


class Ur5e(_Device):
    transport = "rtde"

    def __init__(self, address):
        super().__init__("arm", "ur5e", host=address.rpartition(":")[0])

    def move(self, speed_m_s):
        self.device.command(ArmCommand(Twist((0.0, 0.0, speed_m_s)), 0.5, self.clock.now() + VALID_NS))

    def stop(self):
        self.device.stop()

    def read(self):
        return self.fresh().tcp_pose.position_m[2]


class Fingertip(_Device):
    transport = "http"

    def __init__(self, address):
        super().__init__("sensor", "gelsight-mini", camera=address)

    def read(self):
        return self.fresh().image
