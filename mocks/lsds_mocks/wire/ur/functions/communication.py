"""Script functions for registers, terminals, messages and time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lsds_mocks.wire.ur.controller import CYCLE_S
from lsds_mocks.wire.ur.io import CONFIGURABLE_SHIFT, FLAGS, REGISTER_BITS, REGISTERS, TOOL_SHIFT
from lsds_mocks.wire.ur.messages import PopupMessage, TextMessage
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.program import Waiting
from lsds_mocks.wire.ur.variables import IN

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.controller import Controller


class Functions:
    """Bound to one controller."""

    def __init__(self, controller: Controller) -> None:
        self._c = controller

    # -- time ---------------------------------------------------------------------------------------------

    def sync(self) -> Waiting:
        """Use up the rest of the cycle."""
        yield

    def sleep(self, t: float) -> Waiting:
        """Wait (s)."""
        until = self._c.step_number + max(1, round(t / CYCLE_S))
        while self._c.step_number < until:
            yield

    # -- registers ----------------------------------------------------------------------------------------

    def read_input_integer_register(self, address: int) -> int:
        """Return what a client has written."""
        return self._c.inputs.ints[_index(address)]

    def read_input_float_register(self, address: int) -> float:
        """Return what a client has written."""
        return self._c.inputs.doubles[_index(address)]

    def read_input_boolean_register(self, address: int) -> bool:
        """Return what a client has written."""
        return self._c.inputs.bit(_index(address, REGISTER_BITS))

    def read_output_integer_register(self, address: int) -> int:
        """Return what a program has written."""
        return self._c.registers.ints[_index(address)]

    def read_output_float_register(self, address: int) -> float:
        """Return what a program has written."""
        return self._c.registers.doubles[_index(address)]

    def read_output_boolean_register(self, address: int) -> bool:
        """Return what a program has written."""
        return self._c.registers.bit(_index(address, REGISTER_BITS))

    def write_output_integer_register(self, address: int, value: Any) -> None:
        """Send a number to clients, truncated to 32 bits."""
        self._c.registers.ints[_index(address)] = (int(value) + 2**31) % 2**32 - 2**31

    def write_output_float_register(self, address: int, value: Any) -> None:
        """Send a number to clients."""
        self._c.registers.doubles[_index(address)] = float(value)

    def write_output_boolean_register(self, address: int, value: Any) -> None:
        """Send a boolean to clients."""
        self._c.registers.set_bit(_index(address, REGISTER_BITS), bool(value))

    def rtde_set_watchdog(self, variable_name: str, min_frequency: float, action: str = "pause") -> None:
        """Set the action when a client stops writing a register: "ignore", "pause" or "stop"."""
        if variable_name not in IN:
            raise ScriptError(f"rtde_set_watchdog: there is no input {str(variable_name)[:40]}")
        if min_frequency <= 0 or action == "ignore":
            self._c.watchdogs.pop(variable_name, None)
            return
        self._c.written_s[variable_name] = self._c.time_s
        self._c.watchdogs[variable_name] = (1.0 / min_frequency, action)

    # -- terminals ----------------------------------------------------------------------------------------

    def set_standard_digital_out(self, n: int, b: Any) -> None:
        """Switch an output, 0-7."""
        self._c.io.set_digital(_index(n, 8), bool(b))

    def set_digital_out(self, n: int, b: Any) -> None:
        """Switch an output, 0-7 standard, 8-9 tool."""
        self._c.io.set_digital(_terminal(n), bool(b))

    def set_configurable_digital_out(self, n: int, b: Any) -> None:
        """Switch a configurable output, 0-7."""
        self._c.io.set_digital(_index(n, 8) + CONFIGURABLE_SHIFT, bool(b))

    def set_tool_digital_out(self, n: int, b: Any) -> None:
        """Switch a tool output, 0-1."""
        self._c.io.set_digital(_index(n, 2) + TOOL_SHIFT, bool(b))

    def get_standard_digital_out(self, n: int) -> bool:
        """Return an output."""
        return bool(self._c.io.digital >> _index(n, 8) & 1)

    def get_configurable_digital_out(self, n: int) -> bool:
        """Return a configurable output."""
        return bool(self._c.io.digital >> _index(n, 8) + CONFIGURABLE_SHIFT & 1)

    def get_tool_digital_out(self, n: int) -> bool:
        """Return a tool output."""
        return bool(self._c.io.digital >> _index(n, 2) + TOOL_SHIFT & 1)

    def get_standard_digital_in(self, n: int) -> bool:
        """Return an input."""
        return bool(self._c.io.digital_in >> _index(n, 8) & 1)

    def get_configurable_digital_in(self, n: int) -> bool:
        """Return a configurable input."""
        return bool(self._c.io.digital_in >> _index(n, 8) + CONFIGURABLE_SHIFT & 1)

    def get_tool_digital_in(self, n: int) -> bool:
        """Return a tool input."""
        return bool(self._c.io.digital_in >> _index(n, 2) + TOOL_SHIFT & 1)

    def get_digital_out(self, n: int) -> bool:
        """Return an output, 0-7 standard, 8-9 tool."""
        return bool(self._c.io.digital >> _terminal(n) & 1)

    def get_digital_in(self, n: int) -> bool:
        """Return an input, 0-7 standard, 8-9 tool."""
        return bool(self._c.io.digital_in >> _terminal(n) & 1)

    def set_analog_out(self, n: int, f: float) -> None:
        """Set an analogue output, as a ratio 0..1."""
        self.set_standard_analog_out(n, f)

    def get_analog_out(self, n: int) -> float:
        """Return an analogue output, as a ratio."""
        return self.get_standard_analog_out(n)

    def get_analog_in(self, n: int) -> float:
        """Return an analogue input, 0-1 in the controller, 2-3 in the tool."""
        index = _index(n, 4)
        return self.get_standard_analog_in(index) if index < 2 else self.get_tool_analog_in(index - 2)

    def get_tool_analog_in(self, n: int) -> float:
        """Return an analogue input of the tool, to which nothing is connected."""
        return 0.0 * _index(n, 2)

    def set_analog_inputrange(self, port: int, range: int) -> None:
        """Set the voltage range of an analogue input, 0-1 in the controller, 2-3 in the tool."""
        index, _range = _index(port, 4), _index(range, 5)
        terminals = self._c.io.analog_in_is_voltage if index < 2 else self._c.io.tool_analog_in_is_voltage
        terminals[index % 2] = True

    def set_standard_analog_input_domain(self, port: int, domain: int) -> None:
        """Make an analogue input measure a current (0) or a voltage (1)."""
        self._c.io.analog_in_is_voltage[_index(port, 2)] = bool(_index(domain, 2))

    def set_tool_analog_input_domain(self, port: int, domain: int) -> None:
        """Make an analogue input of the tool measure a current (0) or a voltage (1)."""
        self._c.io.tool_analog_in_is_voltage[_index(port, 2)] = bool(_index(domain, 2))

    def get_flag(self, n: int) -> bool:
        """Return a flag, 0-32."""
        return bool(self._c.io.flags >> _index(n, FLAGS) & 1)

    def set_flag(self, n: int, b: Any) -> None:
        """Set a flag, 0-32, for this program and those after it."""
        place = _index(n, FLAGS)
        self._c.io.flags = self._c.io.flags & ~(1 << place) | int(bool(b)) << place

    def set_standard_analog_out(self, n: int, f: float) -> None:
        """Set an analogue output, as a ratio 0..1."""
        self._c.io.set_analog(_index(n, 2), float(f))

    def get_standard_analog_out(self, n: int) -> float:
        """Return an analogue output, as a ratio."""
        return self._c.io.analog[_index(n, 2)]

    def get_standard_analog_in(self, n: int) -> float:
        """Return an analogue input."""
        return self._c.io.analog_in[_index(n, 2)]

    def set_analog_outputdomain(self, port: int, domain: int) -> None:
        """Make an analogue output a current (0) or a voltage (1)."""
        self._c.io.analog_is_voltage[_index(port, 2)] = bool(domain)

    def set_tool_voltage(self, voltage: int) -> None:
        """Set the tool's supply: 0, 12 or 24 V."""
        if voltage not in (0, 12, 24):
            raise ScriptError(f"set_tool_voltage: {voltage} V is not 0, 12 or 24 V")
        self._c.io.tool_voltage = int(voltage)

    # -- messages -----------------------------------------------------------------------------------------

    def textmsg(self, s1: Any, s2: Any = "") -> None:
        """Write to the log."""
        self._c.post_message(TextMessage(self._c.operations.text(s1) + self._c.operations.text(s2)))

    def popup(
        self, s: Any, title: str = "Popup", warning: bool = False, error: bool = False, blocking: bool = False
    ) -> Waiting:
        """Show a text. A blocking popup pauses the program until it is closed or the program is played again."""
        shown = PopupMessage(str(title), self._c.operations.text(s), bool(warning), bool(error), bool(blocking))
        self._c.show_popup(shown)
        while shown.blocking and self._c.popup is shown:
            yield


def _index(address: Any, count: int = REGISTERS) -> int:
    index = int(address)
    if not 0 <= index < count:
        raise ScriptError(f"index {index} is out of range: 0 to {count - 1}")
    return index


def _terminal(address: Any) -> int:
    """Return the bit of a digital terminal, 0-7 standard, 8-9 tool."""
    index = _index(address, CONFIGURABLE_SHIFT + 2)
    return index if index < CONFIGURABLE_SHIFT else index - CONFIGURABLE_SHIFT + TOOL_SHIFT
