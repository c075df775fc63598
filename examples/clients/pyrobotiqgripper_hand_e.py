"""pyRobotiqGripper: `lsds check gripper --client examples.clients.pyrobotiqgripper_hand_e:Client`."""

import pyrobotiqgripper

OPEN, CLOSED, STROKE_M = 3, 228, 0.050
SLOWEST_M_S, FASTEST_M_S = 0.02, 0.15


class Client:
    transport = "tcp"

    def __init__(self, address):
        host, _, port = address.removeprefix("tcp://").rpartition(":")
        self.gripper = pyrobotiqgripper.RobotiqGripper(
            connection_type=pyrobotiqgripper.GRIPPER_MODE_RTU_VIA_TCP, tcp_host=host, tcp_port=int(port)
        )
        self.gripper.readStatus()
        self.gripper.start()

    def move(self, aperture_m, speed_m_s):
        position = round(CLOSED + aperture_m / STROKE_M * (OPEN - CLOSED))
        speed = round(255 * (speed_m_s - SLOWEST_M_S) / (FASTEST_M_S - SLOWEST_M_S))
        self.gripper.move(position, speed=speed, force=0, wait=False)

    def read(self):
        return STROKE_M * (CLOSED - self.gripper.position()) / (CLOSED - OPEN)

    def close(self):
        self.gripper.disconnect()
