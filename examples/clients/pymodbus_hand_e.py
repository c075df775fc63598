"""pymodbus, RTU over TCP: `lsds check gripper --client examples.clients.pymodbus_hand_e:Client`."""

from pymodbus import FramerType
from pymodbus.client import ModbusTcpClient

OPEN, CLOSED, STROKE_M = 3, 228, 0.050
SLOWEST_M_S, FASTEST_M_S = 0.02, 0.15


class Client:
    transport = "tcp"

    def __init__(self, address):
        host, _, port = address.removeprefix("tcp://").rpartition(":")
        self.modbus = ModbusTcpClient(host, port=int(port), framer=FramerType.RTU, timeout=0.3, retries=1)
        if not self.modbus.connect():
            raise ConnectionError(f"no connection to {address}")

    def move(self, aperture_m, speed_m_s):
        position = round(CLOSED + aperture_m / STROKE_M * (OPEN - CLOSED))
        speed = round(255 * (speed_m_s - SLOWEST_M_S) / (FASTEST_M_S - SLOWEST_M_S))
        self._answered(self.modbus.write_registers(1000, [0x0900, position, speed << 8], device_id=9))

    def read(self):
        answer = self._answered(self.modbus.read_input_registers(2000, count=3, device_id=9))
        return STROKE_M * (CLOSED - (answer.registers[2] >> 8)) / (CLOSED - OPEN)

    def close(self):
        self.modbus.close()

    def _answered(self, answer):
        if answer.isError():
            raise OSError(str(answer))
        return answer
