"""Inputs and outputs, and the registers through which clients and programs communicate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

REGISTERS = 48
"""Number of integer registers, and of double registers, per direction."""
REGISTER_BITS = 128
"""Number of bit registers per direction."""

FLAGS = 33
"""Number of flags (0 to 32); they persist from one program to the next."""

STANDARD_SHIFT = 0
"""Position of the standard inputs or outputs in the word of all digital ones, bits."""
CONFIGURABLE_SHIFT = 8
"""Position of the configurable ones in that word, bits."""
TOOL_SHIFT = 16
"""Position of the tool's in that word, bits."""


class Registers:
    """One direction's general-purpose registers: 48 integers, 48 doubles, 128 bits (as one number)."""

    def __init__(self) -> None:
        self.ints = [0] * REGISTERS
        self.doubles = [0.0] * REGISTERS
        self.bits = 0

    def bit(self, index: int) -> bool:
        """Return one bit."""
        return bool(self.bits >> index & 1)

    def set_bit(self, index: int, value: bool) -> None:
        """Change one bit."""
        self.bits = self.bits & ~(1 << index) | (int(value) << index)


class Outputs:
    """Digital outputs (bits 0-7 standard, 8-15 configurable, 16-17 tool), analogue outputs as ratios, speed slider."""

    def __init__(self) -> None:
        self.digital = 0
        self.digital_in = 0
        self.analog = [0.0, 0.0]
        self.analog_is_voltage = [True, True]
        self.analog_in = [0.0, 0.0]
        self.analog_in_is_voltage = [True, True]
        self.tool_analog_in_is_voltage = [True, True]
        self.flags = 0
        self.tool_voltage = 0
        self.slider = 1.0

    def set_digital(self, index: int, value: bool) -> None:
        """Change one digital output."""
        self.digital = self.digital & ~(1 << index) | (int(value) << index)

    def set_analog(self, index: int, ratio: float) -> None:
        """Change one analogue output."""
        self.analog[index] = _ratio(ratio, self.analog[index])

    def shown(self, index: int) -> float:
        """Return an analogue output as a measured value: 0..10 V, or 4..20 mA in ampere."""
        ratio = self.analog[index]
        return ratio * 10.0 if self.analog_is_voltage[index] else 0.004 + ratio * 0.016

    @property
    def types(self) -> int:
        """Return the types of the analogue terminals: inputs in bits 0-1, outputs in bits 2-3; 1 is voltage."""
        terminals = (*self.analog_in_is_voltage, *self.analog_is_voltage)
        return sum(int(voltage) << place for place, voltage in enumerate(terminals))

    @property
    def tool_types(self) -> int:
        """Return the types of the tool's analogue inputs, as `types`."""
        return sum(int(voltage) << place for place, voltage in enumerate(self.tool_analog_in_is_voltage))

    def apply(self, values: Mapping[str, Any]) -> None:
        """Apply one data package's outputs; only the values that its masks select change."""
        for name, shift, width in (
            ("standard", STANDARD_SHIFT, 8),
            ("configurable", CONFIGURABLE_SHIFT, 8),
            ("tool", TOOL_SHIFT, 2),
        ):
            mask = values.get(f"{name}_digital_output_mask")
            if mask is not None and f"{name}_digital_output" in values:
                mask = (mask & ((1 << width) - 1)) << shift
                wanted = values[f"{name}_digital_output"] << shift
                self.digital = self.digital & ~mask | wanted & mask
        mask = values.get("standard_analog_output_mask", 0)
        for index in (0, 1):
            ratio = values.get(f"standard_analog_output_{index}")
            if mask >> index & 1 and ratio is not None:
                self.set_analog(index, ratio)
                self.analog_is_voltage[index] = bool(values.get("standard_analog_output_type", 0) >> index & 1)
        if values.get("speed_slider_mask", 0) and "speed_slider_fraction" in values:
            self.slider = _ratio(values["speed_slider_fraction"], self.slider)


def _ratio(value: float, before: float) -> float:
    """Return a value clamped to 0..1, or `before` if it is NaN."""
    return before if math.isnan(value) else min(max(value, 0.0), 1.0)
