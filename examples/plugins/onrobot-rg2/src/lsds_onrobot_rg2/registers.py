"""Register map of an RG2 behind OnRobot's Compute Box, as the driver uses it.

Documented in OnRobot's connection guide, section Modbus, RG2/6: addresses, units, ranges, flags, and that the gripper
ignores a grip while it is busy. Readable registers take function code 3, writable ones 6 or 16.

Assumed, because the guide does not state it:

- One request may read the block from 258 to 275, although the guide does not list all of its registers. Public ROS
  drivers of this gripper do the same.
- `STOP` keeps the fingers where they are, also while they hold an object: the guide defines it for a motion only.
- The force is that of one finger.
- The busy flag is high within `gripper.SETTLES_NS` of an accepted grip.
- No register sets the speed. It depends on the force; `SPEED_M_S` is a typical value.
"""

from __future__ import annotations

from typing import NamedTuple

from lsds.contracts import GripperSpec

UNIT = 65
"""Modbus unit of a single gripper (a dual quick changer has 66 and 67)."""
TARGET_FORCE = 0
"""First of three registers: force (1/10 N), width (1/10 mm), control. One write sets all three."""
CONTROL = 2
"""Register of `STOP` and `GRIP_WITH_OFFSET`."""
STOP = 8
"""Control value that ends a motion."""
GRIP_WITH_OFFSET = 16
"""Control value that starts a motion to the distance between the fingertips; 1 would be that of the bare fingers."""
BLOCK, BLOCK_LENGTH = 258, 18
"""Registers from the fingertip offset (258) to the width with offset (275)."""
STATUS_AT, WIDTH_AT = 268 - BLOCK, 275 - BLOCK
"""Indices in the block: status flags, and distance between the fingertips (1/10 mm, signed)."""

TENTHS_PER_M = 10_000
"""Tenths of a millimetre in a metre."""
PLAUSIBLE_TENTHS = (-200, 1300)
"""Widths (1/10 mm) that an RG2 can report, with room for fingertips; an RG6 opens to 1600."""

SPEED_M_S = 0.1
"""Closing speed of the fingers (m/s), assumed."""
SPEC = GripperSpec(
    stroke_m=0.11, resolution_m=1e-4, speed_m_s=(SPEED_M_S, SPEED_M_S), force_n=(3.0, 40.0), latency_s=0.05
)
"""Stroke and force range: data sheet. Resolution: the unit of the width register. Speed and latency: assumed."""

_BUSY, _GRIP = 1, 2
_POWER_CYCLE = "remove the object and the cause, then switch the gripper off and on"
_FLAGS = (
    (8, "safety circuit 1 has tripped", _POWER_CYCLE),
    (32, "safety circuit 2 has tripped", _POWER_CYCLE),
    (64, "a safety switch was pushed at power-on", _POWER_CYCLE),
    (4, "safety switch 1 is pushed", "release the switch"),
    (16, "safety switch 2 is pushed", "release the switch"),
)
"""Safety flags (bit, problem, remedy), the lasting ones first."""


class Status(NamedTuple):
    """One answer of the gripper. `fault` is the problem and the remedy of a safety flag, None without one."""

    t_ns: int
    aperture_m: float
    busy: bool
    gripping: bool
    fault: tuple[str, str] | None


def status_of(t_ns: int, block: list[int]) -> Status:
    """Return the status in a block of registers. Raises ValueError for a width that an RG2 cannot have."""
    tenths = block[WIDTH_AT] - (block[WIDTH_AT] >> 15 << 16)
    if not PLAUSIBLE_TENTHS[0] <= tenths <= PLAUSIBLE_TENTHS[1]:
        raise ValueError(f"a width of {tenths / 10} mm")
    flags = block[STATUS_AT]
    fault = next(((problem, remedy) for bit, problem, remedy in _FLAGS if flags & bit), None)
    return Status(t_ns, max(tenths, 0) / TENTHS_PER_M, bool(flags & _BUSY), bool(flags & _GRIP), fault)


def motion_words(aperture_m: float, force_n: float) -> list[int]:
    """Return the words from `TARGET_FORCE` that start a motion."""
    return [round(force_n * 10), round(aperture_m * TENTHS_PER_M), GRIP_WITH_OFFSET]
