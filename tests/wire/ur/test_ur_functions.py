"""Functions for terminals, flags and variables behind a socket; terminals as older programs and clients write them."""

from __future__ import annotations

import socket

import pytest
from lsds_mocks.wire.ur.controller import Controller
from lsds_mocks.wire.ur.environment import Environment
from lsds_mocks.wire.ur.functions import Library, waiting
from lsds_mocks.wire.ur.messages import RuntimeExceptionMessage, TextMessage
from lsds_mocks.wire.ur.modes import RobotMode
from lsds_mocks.wire.ur.options import UrOptions
from lsds_mocks.wire.ur.script.compiler import compile_script
from lsds_mocks.wire.ur.script.errors import ScriptError

from tests.wire.ur.arms import Dashboard, Primary
from tests.wire.waiting import until


class Bench:
    def __init__(self, **options):
        self.controller = Controller(UrOptions(**options), Environment(), Library)

    def run(self, text, cycles=50):
        self.controller.start(compile_script(text, waiting()))
        for _ in range(cycles):
            self.controller.cycle()
        messages = list(self.controller.messages)
        self.controller.messages.clear()
        return (
            [m.text for m in messages if isinstance(m, TextMessage)],
            [m.text for m in messages if isinstance(m, RuntimeExceptionMessage)],
        )


def test_terminals_by_the_older_functions():
    bench = Bench()
    texts, errors = bench.run(
        """def p():
  set_digital_out(1, True)
  set_digital_out(8, True)
  set_analog_out(0, 0.25)
  set_analog_inputrange(0, 1)
  set_standard_analog_input_domain(1, 0)
  set_tool_analog_input_domain(1, 0)
  set_analog_inputrange(3, 0)
  textmsg(get_digital_out(1), get_digital_out(8))
  textmsg(get_analog_out(0), get_analog_in(0))
  textmsg(get_analog_in(3), get_digital_in(2))
end
"""
    )
    assert errors == []
    assert texts == ["TrueTrue", "0.250", "0False"]
    assert bench.controller.io.digital == 1 << 1 | 1 << 16
    assert bench.controller.io.types == 0b1101
    assert bench.controller.io.tool_types == 0b11


def test_terminals_as_elements_of_lists():
    bench = Bench()
    bench.controller.io.digital_in = 0b100
    texts, errors = bench.run(
        "def p():\n digital_out[3] = True\n analog_out[1] = 0.5\n"
        " textmsg(digital_out[3], digital_in[2])\n textmsg(analog_out[1], analog_in[0])\nend\n"
    )
    assert (texts, errors) == (["TrueTrue", "0.50"], [])
    assert bench.controller.io.digital == 0b1000


def test_a_variable_of_the_same_name_is_a_variable():
    texts, _ = Bench().run("def p():\n digital_out = [1, 2]\n digital_out[0] = 5\n textmsg(digital_out)\nend\n")
    assert texts == ["[5, 2]"]


@pytest.mark.parametrize("line", ["digital_in[0] = True", "digital_inn[0] = True"])
def test_what_cannot_be_written_is_refused(line):
    with pytest.raises(ScriptError):
        compile_script(f"def p():\n {line}\nend\n", waiting())


@pytest.mark.parametrize("line", ["digital_out[10] = True", "digital_out[-1] = True", "set_flag(33, True)"])
def test_a_terminal_that_is_none_is_an_error(line):
    assert len(Bench().run(f"def p():\n {line}\nend\n")[1]) == 1


def test_flags_stay_from_one_program_to_the_next():
    bench = Bench()
    assert bench.run("def p():\n set_flag(0, True)\n set_flag(32, True)\n set_flag(5, False)\nend\n") == ([], [])
    texts, _ = bench.run("def q():\n textmsg(get_flag(0), get_flag(5))\n textmsg(get_flag(32))\nend\n")
    assert texts == ["TrueFalse", "True"]


def test_a_script_sent_while_the_arm_has_no_power_is_refused_aloud():
    bench = Bench(powered=False)
    controller = bench.controller
    assert "POWER_OFF" in bench.run("def early():\n sync()\nend\n", cycles=1)[1][0]
    controller.power.release(controller.time_s)
    while controller.power.mode is not RobotMode.RUNNING:
        controller.cycle()
        if controller.step_number % 100 == 0 and controller.power.mode is not RobotMode.RUNNING:
            assert "early is not started" in bench.run("def early():\n sync()\nend\n", cycles=0)[1][0]
    assert bench.run('def late():\n textmsg("here")\nend\n') == (["here"], [])


# -- on the wire ----------------------------------------------------------------------------------------------


def test_a_client_of_the_older_kind_switches_an_output(host):
    """As clients do that send single lines: each is a program, and none is lost."""
    with Primary(host) as primary:
        for number in range(8):
            primary.send(f"digital_out[{number}]=True\n")
        assert until(lambda: int.from_bytes(primary.state()[3][4:8], "big") & 0xFF == 0xFF)
        primary.send("".join(f"digital_out[{number}]=False\n" for number in range(8)))
        assert until(lambda: int.from_bytes(primary.state()[3][4:8], "big") & 0xFF == 0)


def test_variables_behind_a_socket(host):
    with socket.create_server((host, 0)) as server, Primary(host) as primary:
        server.settimeout(5)
        primary.send(
            f"""def p():
  socket_open("{host}", {server.getsockname()[1]}, "gripper")
  socket_set_var("POS", 77, "gripper")
  ack = socket_read_byte_list(3, "gripper", 5)
  textmsg(ack == [3, 97, 99, 107])
  textmsg(socket_get_var("POS", "gripper") + 1)
  textmsg(socket_get_var("ODD", "gripper"))
end
"""
        )
        link, _ = server.accept()
        with link:
            link.settimeout(5)
            assert line(link) == b"SET POS 77\n"
            link.sendall(b"ack")
            assert primary.message(0) == b"True"
            assert line(link) == b"GET POS\n"
            link.sendall(b"POS 76\n")
            assert primary.message(0) == b"77"
            assert line(link) == b"GET ODD\n"
            link.sendall(b"nothing of the kind\n")
            assert primary.message(0) == b"0"


def line(link):
    data = b""
    while not data.endswith(b"\n"):
        data += link.recv(1)
    return data


def test_modes_are_reported_at_once_with_the_state(host):
    """A client that goes by the last state it had takes an arm in a protective stop for one that has been unlocked."""
    with Primary(host) as primary, Dashboard(host) as dashboard:
        primary.state()
        primary.send("sec stops():\n protective_stop()\nend\n")
        before = None
        while True:
            kind, body = primary.package()
            if kind == 20 and body[9] == 5:
                break
            if kind == 16:
                before = body
        assert before is not None, "no state came before the message"
        # Mode data is the first part: its size, its number, a time stamp, and flags, of which the fifth is this stop.
        assert before[5 + 8 + 4] == 1
        assert dashboard.ask("safetymode") == "Safetymode: PROTECTIVE_STOP"
        dashboard.ask("restart safety")
        dashboard.ask("brake release")
        assert until(lambda: dashboard.ask("robotmode") == "Robotmode: RUNNING", 10)
