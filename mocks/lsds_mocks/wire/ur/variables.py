"""The variables of RTDE: name, type on the wire, and source of the value.

A recipe is compiled into one function, so that a package costs one call and one `struct.pack`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from lsds_mocks.wire.ur.io import REGISTERS
from lsds_mocks.wire.ur.modes import JOINT_IDLE, JOINT_POWER_OFF, JOINT_RUNNING, RobotMode, SafetyMode

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.controller import Controller

FORMATS = {
    "BOOL": "?",
    "UINT8": "B",
    "UINT32": "I",
    "UINT64": "Q",
    "INT32": "i",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
    "VECTOR6UINT32": "6I",
}
_VECTORS = ("VECTOR3D", "VECTOR6D", "VECTOR6INT32", "VECTOR6UINT32")

_MAIN_V = 48.0
"""Main voltage (V); constant, because it is not modelled."""
_ROBOT_V = 48.0
"""Robot voltage (V); constant, because it is not modelled."""
_IDLE_A = 0.6
"""Current of the arm (A); constant, because it is not modelled."""
_JOINT_C = 28.0
"""Temperature of a joint (°C); constant, because it is not modelled."""


def robot_status(c: Controller) -> int:
    """Bits: power on, program running."""
    powered = c.power.mode in (RobotMode.POWER_ON, RobotMode.IDLE, RobotMode.RUNNING)
    return int(powered) | int(c.program is not None) << 1


def safety_status(c: Controller) -> int:
    """Bits: normal, reduced, protective stop, ..., stopped due to safety (bit 10)."""
    normal = c.safety is SafetyMode.NORMAL
    stopped = c.safety is SafetyMode.PROTECTIVE_STOP
    return int(normal) | int(stopped) << 2 | int(not normal) << 10


def joint_mode(c: Controller) -> int:
    """Mode of the joints, equal for all."""
    if c.power.mode is RobotMode.RUNNING:
        return JOINT_RUNNING
    return JOINT_POWER_OFF if c.power.mode is RobotMode.POWER_OFF else JOINT_IDLE


_SIX_ZEROS = "(0.0,) * 6"
_OUT: dict[str, tuple[str, str]] = {
    "timestamp": ("DOUBLE", "c.time_s"),
    "target_q": ("VECTOR6D", "c.arm.q"),
    "target_qd": ("VECTOR6D", "[c.scaling * v for v in c.arm.qd]"),
    "target_qdd": ("VECTOR6D", "[c.scaling ** 2 * v for v in c.arm.qdd]"),
    "actual_q": ("VECTOR6D", "c.arm.q"),
    "actual_qd": ("VECTOR6D", "[c.scaling * v for v in c.arm.qd]"),
    "actual_TCP_pose": ("VECTOR6D", "c.tcp_pose"),
    "target_TCP_pose": ("VECTOR6D", "c.tcp_pose"),
    "actual_TCP_speed": ("VECTOR6D", "c.tcp_speed"),
    "target_TCP_speed": ("VECTOR6D", "c.tcp_speed"),
    "actual_TCP_force": ("VECTOR6D", "c.tcp_force"),
    "ft_raw_wrench": ("VECTOR6D", "c.wrench"),
    "wrench_calc_from_currents": ("VECTOR6D", "c.wrench"),
    "tcp_force_scalar": ("DOUBLE", "sum(f * f for f in c.tcp_force[:3]) ** 0.5"),
    "tcp_offset": ("VECTOR6D", "c.arm.tcp_offset"),
    "joint_temperatures": ("VECTOR6D", f"({_JOINT_C},) * 6"),
    "actual_joint_voltage": ("VECTOR6D", f"({_ROBOT_V},) * 6"),
    "payload": ("DOUBLE", "c.payload_kg"),
    "payload_cog": ("VECTOR3D", "c.payload_cog_m"),
    "payload_inertia": ("VECTOR6D", "c.payload_inertia"),
    "target_gravity": ("VECTOR3D", "c.gravity"),
    "actual_tool_accelerometer": ("VECTOR3D", "c.gravity"),
    "elbow_position": ("VECTOR3D", "c.kinematics.frames(c.arm.q).points[2]"),
    "elbow_velocity": ("VECTOR3D", "(0.0,) * 3"),
    "speed_scaling": ("DOUBLE", "c.scaling"),
    "target_speed_fraction": ("DOUBLE", "c.scaling"),
    "actual_main_voltage": ("DOUBLE", str(_MAIN_V)),
    "actual_robot_voltage": ("DOUBLE", str(_ROBOT_V)),
    "actual_robot_current": ("DOUBLE", str(_IDLE_A)),
    "standard_analog_input0": ("DOUBLE", "c.io.analog_in[0]"),
    "standard_analog_input1": ("DOUBLE", "c.io.analog_in[1]"),
    "standard_analog_output0": ("DOUBLE", "c.io.shown(0)"),
    "standard_analog_output1": ("DOUBLE", "c.io.shown(1)"),
    "joint_mode": ("VECTOR6INT32", "(joint_mode(c),) * 6"),
    "robot_mode": ("INT32", "int(c.power.mode)"),
    "safety_mode": ("INT32", "int(c.safety)"),
    "safety_status": ("INT32", "int(c.safety)"),
    "runtime_state": ("UINT32", "int(c.runtime_state)"),
    "robot_status_bits": ("UINT32", "robot_status(c)"),
    "safety_status_bits": ("UINT32", "safety_status(c)"),
    "analog_io_types": ("UINT32", "c.io.types"),
    "tool_analog_input_types": ("UINT32", "c.io.tool_types"),
    "actual_digital_input_bits": ("UINT64", "c.io.digital_in"),
    "actual_digital_output_bits": ("UINT64", "c.io.digital"),
    "actual_configurable_digital_input_bits": ("UINT64", "c.io.digital_in >> 8 & 255"),
    "actual_configurable_digital_output_bits": ("UINT64", "c.io.digital >> 8 & 255"),
    "tool_output_voltage": ("INT32", "c.io.tool_voltage"),
    "control_step": ("UINT64", "c.step_number"),
    "script_control_line": ("UINT32", "0"),
    "time_scale_source": ("INT32", "0"),
    "actual_execution_time": ("DOUBLE", "0.0"),
    "target_execution_time": ("DOUBLE", "0.0"),
}
_UNMODELLED = {
    "VECTOR6D": """target_current target_moment actual_current actual_current_window actual_current_as_torque
        joint_control_output actual_TCP_acceleration target_TCP_acceleration target_base_acceleration
        target_base_wrench""",
    "DOUBLE": """actual_momentum io_current euromap67_24V_voltage euromap67_24V_current tool_analog_input0
        tool_analog_input1 tool_output_current joint_position_deviation_ratio collision_detection_ratio
        actual_robot_energy_consumed actual_robot_braking_energy_dissipated""",
    "UINT32": "euromap67_input_bits euromap67_output_bits tool_mode",
    "INT32": "encoder0_raw encoder1_raw",
    "UINT8": "tool_output_mode tool_digital_output0_mode tool_digital_output1_mode",
}
"""Variables that are always zero, by type."""

for _type, _words in _UNMODELLED.items():
    _OUT |= dict.fromkeys(_words.split(), (_type, _SIX_ZEROS if _type == "VECTOR6D" else "0"))
_OUT["tool_temperature"] = ("DOUBLE", str(_JOINT_C))
for _side, _where in (("output", "c.registers"), ("input", "c.inputs")):
    _OUT |= {f"{_side}_int_register_{i}": ("INT32", f"{_where}.ints[{i}]") for i in range(REGISTERS)}
    _OUT |= {f"{_side}_double_register_{i}": ("DOUBLE", f"{_where}.doubles[{i}]") for i in range(REGISTERS)}
    _OUT |= {f"{_side}_bit_register_{i}": ("BOOL", f"{_where}.bit({i})") for i in range(64, 128)}
    _OUT[f"{_side}_bit_registers0_to_31"] = ("UINT32", f"{_where}.bits & 0xFFFFFFFF")
    _OUT[f"{_side}_bit_registers32_to_63"] = ("UINT32", f"{_where}.bits >> 32 & 0xFFFFFFFF")

IN: dict[str, str] = {
    "speed_slider_mask": "UINT32",
    "speed_slider_fraction": "DOUBLE",
    "standard_analog_output_mask": "UINT8",
    "standard_analog_output_type": "UINT8",
    "standard_analog_output_0": "DOUBLE",
    "standard_analog_output_1": "DOUBLE",
    "input_bit_registers0_to_31": "UINT32",
    "input_bit_registers32_to_63": "UINT32",
    "external_force_torque": "VECTOR6D",
}
"""Input variables and their types."""
for _name in ("standard", "configurable", "tool"):
    IN |= {f"{_name}_digital_output_mask": "UINT8", f"{_name}_digital_output": "UINT8"}
IN |= {f"input_int_register_{i}": "INT32" for i in range(REGISTERS)}
IN |= {f"input_double_register_{i}": "DOUBLE" for i in range(REGISTERS)}
IN |= {f"input_bit_register_{i}": "BOOL" for i in range(64, 128)}

Packer = Callable[["Controller"], bytes]


def output_type(name: str) -> str | None:
    """Return an output variable's type; None for an unknown name."""
    found = _OUT.get(name)
    return None if found is None else found[0]


def recipe_size(names: Sequence[str]) -> int:
    """Return the size of an output package with its head (bytes)."""
    return struct.calcsize(">HBB" + _formats(names))


def _formats(names: Sequence[str]) -> str:
    return "".join(FORMATS[_OUT[name][0]] for name in names)


def packer(names: Sequence[str], head: bytes) -> Packer:
    """Return a compiled output recipe: a function from the controller to a package's bytes (size, `head`, values)."""
    values = [("*" if _OUT[name][0] in _VECTORS else "") + f"({_OUT[name][1]})" for name in names]
    layout = struct.Struct(">" + _formats(names))
    front = struct.pack(">H", layout.size + len(head) + 2) + head
    space: dict[str, Any] = {
        "pack": layout.pack,
        "front": front,
        "joint_mode": joint_mode,
        "robot_status": robot_status,
        "safety_status": safety_status,
    }
    packed: Packer = eval(f"lambda c: front + pack({', '.join(values)})", space)
    return packed


class Unpacker:
    """An input recipe, which converts a package's bytes to values by name."""

    def __init__(self, names: Sequence[str]) -> None:
        self.names = tuple(names)
        self._layout = struct.Struct(">" + "".join(FORMATS[IN[name]] for name in names))
        self._vectors = any(IN[name] in _VECTORS for name in names)

    def values(self, data: bytes) -> dict[str, Any]:
        """Return the values. Data longer than the recipe is truncated, as in the controller.

        Raises ValueError for data that is too short.
        """
        if len(data) < self._layout.size:
            raise ValueError(f"{len(data)} bytes for a recipe of {self._layout.size}")
        flat = self._layout.unpack_from(data)
        if not self._vectors:
            return dict(zip(self.names, flat, strict=True))
        found, at = {}, 0
        for name in self.names:
            size = 6 if IN[name] in _VECTORS else 1
            found[name] = list(flat[at : at + size]) if size > 1 else flat[at]
            at += size
        return found
