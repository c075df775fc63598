"""Factories of the driver backends, each a gripper over a transport."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lsds_drivers.robotiq.gripper import RobotiqGripper
from lsds_drivers.robotiq.modbus import ModbusTransport
from lsds_drivers.robotiq.urcap import UrcapTransport

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds_drivers.robotiq.options import HandEOptions, TwoFingerOptions, UrcapOptions


def hand_e(options: HandEOptions, context: BuildContext) -> RobotiqGripper:
    """Return the driver of a Hand-E on Modbus RTU."""
    return _on_modbus("hand-e", options, context)


def two_finger(options: TwoFingerOptions, context: BuildContext) -> RobotiqGripper:
    """Return the driver of a 2F-85 or 2F-140 on Modbus RTU."""
    return _on_modbus("robotiq-2f", options, context)


def hand_e_urcap(options: UrcapOptions, context: BuildContext) -> RobotiqGripper:
    """Return the driver of a Hand-E behind Robotiq's URCap."""
    name = "hand-e-urcap"
    transport = UrcapTransport(name, options.host, options.port, options.answer_timeout_ms * 1e-3, context.clock)
    return RobotiqGripper(name, options, transport, context.clock)


def _on_modbus(name: str, options: HandEOptions, context: BuildContext) -> RobotiqGripper:
    transport = ModbusTransport(name, options.port, options.slave, options.baud, options.answer_timeout_ms * 1e-3)
    return RobotiqGripper(name, options, transport, context.clock)
