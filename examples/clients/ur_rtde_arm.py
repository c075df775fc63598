"""ur_rtde, its control and its receive interface: `lsds check arm --client examples.clients.ur_rtde_arm:Client`."""

from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface

ACCELERATION_M_S2 = 0.5
LASTS_S = 0.2


class Client:
    transport = "rtde"

    def __init__(self, address):
        host = address.rpartition(":")[0]
        self.receive = RTDEReceiveInterface(host)
        self.control = RTDEControlInterface(host)

    def move(self, speed_m_s):
        if not self.control.speedL([0.0, 0.0, speed_m_s, 0.0, 0.0, 0.0], ACCELERATION_M_S2, LASTS_S):
            raise OSError("speedL returned False")

    def stop(self):
        if self.control.speedStop() is False:
            raise OSError("speedStop returned False")

    def read(self):
        if not self.receive.isConnected():
            raise ConnectionError("not connected")
        return self.receive.getActualTCPPose()[2]

    def close(self):
        self.control.stopScript()
        self.control.disconnect()
        self.receive.disconnect()
