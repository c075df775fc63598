"""minimalmodbus at a serial line: `lsds check gripper --client examples.clients.minimalmodbus_hand_e:Client`."""

import minimalmodbus

OPEN, CLOSED, STROKE_M = 3, 228, 0.050
SLOWEST_M_S, FASTEST_M_S = 0.02, 0.15


class Client:
    transport = "pty"

    def __init__(self, address):
        self.gripper = minimalmodbus.Instrument(address, 9)
        self.gripper.serial.baudrate = 115200
        self.gripper.serial.timeout = 0.3

    def move(self, aperture_m, speed_m_s):
        position = round(CLOSED + aperture_m / STROKE_M * (OPEN - CLOSED))
        speed = round(255 * (speed_m_s - SLOWEST_M_S) / (FASTEST_M_S - SLOWEST_M_S))
        self.gripper.write_registers(1000, [0x0900, position, speed << 8])

    def read(self):
        position = self.gripper.read_registers(2000, 3, functioncode=4)[2] >> 8
        return STROKE_M * (CLOSED - position) / (CLOSED - OPEN)

    def close(self):
        self.gripper.serial.close()
