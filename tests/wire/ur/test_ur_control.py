"""Who may command the arm, and when nothing moves: local control, stops, popups, switching off."""

from __future__ import annotations

import socket
import struct
import time

import pytest

from lsds.testing import wire_mock
from tests.wire.ur.arms import Dashboard, Primary
from tests.wire.waiting import until

REFUSED = "Command is not allowed due to safety reasons"
SLOW_MOVE = "movej([0, -1.57, 1.57, -1.57, -1.57, 0], a=1, v=0.05)\n"


@pytest.fixture(scope="module")
def arm():
    with wire_mock("ur5e") as mock:
        yield mock


@pytest.fixture
def dashboard(arm):
    with Dashboard(arm.host) as client:
        yield client
        client.ask("stop")


def mode(dashboard):
    return dashboard.ask("robotmode").removeprefix("Robotmode: ")


def ended(client):
    """Whether a connection that is read ends."""
    try:
        while client.package():
            pass
    except (EOFError, ConnectionError):
        return True
    except TimeoutError:
        return False


# -- local control --------------------------------------------------------------------------------------------


def test_in_local_control_the_dashboard_answers_but_does_not_act():
    with wire_mock("ur5e", remote_control=False, powered=False) as arm, Dashboard(arm.host) as dashboard:
        for request in ("power on", "brake release", "load wait_program.urp", "play", "pause", "stop", "shutdown"):
            assert dashboard.ask(request).startswith(REFUSED), request
        assert dashboard.ask("robotmode") == "Robotmode: POWER_OFF"
        assert dashboard.ask("popup hello") == "showing popup"
        assert dashboard.ask("get loaded program") == "No program loaded"


def test_in_local_control_the_script_ports_only_read_and_say_so():
    with wire_mock("ur5e", remote_control=False) as arm, Primary(arm.host) as primary:
        primary.send(SLOW_MOVE)
        assert struct.unpack_from(">i", primary.message(6)) == (210,)
        for port in (30002, 30003):
            with socket.create_connection((arm.host, port)) as other:
                other.sendall(SLOW_MOVE.encode())
        time.sleep(0.5)
        assert not arm.truth.moving


def test_clients_reconnect_after_the_control_has_changed():
    with wire_mock("ur5e") as arm, Dashboard(arm.host) as old:
        with Primary(arm.host) as writer, Primary(arm.host, 30011) as reader:
            assert old.ask("set operational mode manual") == "Operational mode 'MANUAL' is set"
            assert ended(writer)
            assert reader.state()
        with Primary(arm.host) as local:
            local.package()
            old.ask("set operational mode automatic")
            assert old.ask("is in remote control") == "true"
            assert old.ask("power off").startswith(REFUSED)
            local.send(SLOW_MOVE)
            assert struct.unpack_from(">i", local.message(6)) == (210,)
            with Dashboard(arm.host) as new, Primary(arm.host) as remote:
                assert new.ask("stop") == "Stopped"
                remote.send(SLOW_MOVE)
                assert until(lambda: arm.truth.moving)


# -- stops ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lines", [1, 2000])
def test_nothing_moves_after_a_stop_although_its_program_was_still_compiled(arm, dashboard, lines):
    with socket.create_connection((arm.host, 30002)) as client:
        body = "".join(f"  x{number} = {number}\n" for number in range(lines))
        client.sendall(f"def late():\n{body}  {SLOW_MOVE}end\n".encode())
        assert until(lambda: arm.received and "late" in str(arm.received[-1].meaning))
        assert dashboard.ask("stop") == "Stopped"
        time.sleep(1.0)
        assert dashboard.ask("running") == "Program running: false"
        assert not arm.truth.moving
        client.sendall(b"def next():\n  sleep(60)\nend\n")
        assert until(lambda: dashboard.ask("running") == "Program running: true"), "later programs run"


def test_an_emergency_stop_cuts_the_power_until_it_is_released(arm, dashboard):
    with Primary(arm.host) as primary:
        primary.send(SLOW_MOVE)
        assert until(lambda: arm.truth.moving)
        with arm.fault("emergency-stop"):
            assert until(lambda: dashboard.ask("safetystatus") == "Safetystatus: ROBOT_EMERGENCY_STOP")
            assert not arm.truth.moving
            assert until(lambda: mode(dashboard) == "POWER_OFF")
            dashboard.ask("power on")
            time.sleep(0.6)
            assert mode(dashboard) == "POWER_OFF", "a pressed button keeps the power off"
        assert until(lambda: dashboard.ask("safetystatus") == "Safetystatus: NORMAL")
        assert mode(dashboard) == "POWER_OFF"
        dashboard.ask("brake release")
        assert until(lambda: mode(dashboard) == "RUNNING")


def test_a_protective_stop_does_not_hide_a_pressed_emergency_stop():
    with (
        wire_mock("ur5e") as arm,
        Dashboard(arm.host) as dashboard,
        arm.fault("emergency-stop"),
        arm.fault("protective-stop"),
    ):
        assert until(lambda: mode(dashboard) == "POWER_OFF", 2.0)
        assert dashboard.ask("safetystatus") == "Safetystatus: ROBOT_EMERGENCY_STOP"


def test_power_that_is_switched_on_while_it_goes_off_comes_on_afterwards(dashboard):
    dashboard.ask("power off")
    dashboard.ask("power on")
    assert until(lambda: mode(dashboard) == "POWER_OFF")
    assert until(lambda: mode(dashboard) == "IDLE")
    dashboard.ask("brake release")
    assert until(lambda: mode(dashboard) == "RUNNING")


def test_a_shutdown_ends_all_connections():
    with wire_mock("ur5e") as arm, Dashboard(arm.host) as dashboard, Primary(arm.host, 30011) as primary:
        assert dashboard.ask("shutdown") == "Shutting down"
        assert ended(primary)
        with pytest.raises(ConnectionRefusedError):
            Dashboard(arm.host)


def test_a_program_that_is_compiled_does_not_start_while_the_power_goes_off(arm, dashboard):
    with socket.create_connection((arm.host, 30002)) as client:
        body = "".join(f"  y{number} = {number}\n" for number in range(500))
        client.sendall(f"def late():\n{body}  {SLOW_MOVE}end\n".encode())
        assert until(lambda: arm.received and "late" in str(arm.received[-1].meaning))
        dashboard.ask("power off")
        time.sleep(1.0)
        assert not arm.truth.moving
        assert dashboard.ask("running") == "Program running: false"
    dashboard.ask("brake release")
    assert until(lambda: mode(dashboard) == "RUNNING")


def test_a_secondary_program_outlives_a_stop_that_comes_while_it_is_compiled(arm, dashboard):
    with Primary(arm.host) as primary:
        primary.send("sec output():\n  set_digital_out(5, True)\nend\n")
        dashboard.ask("stop")
        assert until(lambda: struct.unpack_from(">II", primary.state()[3])[1] >> 5 & 1)


def test_a_shutdown_is_final_whatever_fault_ends():
    with wire_mock("ur5e") as arm, Dashboard(arm.host) as dashboard:
        with arm.fault("protective-stop"):
            dashboard.ask("shutdown")
            time.sleep(1.0)
        time.sleep(0.3)
        with pytest.raises(ConnectionRefusedError):
            Dashboard(arm.host)


def test_a_moment_of_local_control_ends_the_script_connections(dashboard):
    with wire_mock("ur5e") as arm, Dashboard(arm.host) as own, Primary(arm.host) as writer:
        own.socket.sendall(b"set operational mode manual\nset operational mode automatic\n")
        own.line()
        own.line()
        writer.send(SLOW_MOVE)
        assert ended(writer)
        assert not arm.truth.moving


# -- programs -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("request_", ["close popup", "play"])
def test_a_blocking_popup_waits_for_the_operator(arm, dashboard, request_):
    with Primary(arm.host) as primary:
        primary.send(
            'def ask():\n  set_digital_out(6, False)\n  popup("go on?", title="Sure", blocking=True)\n'
            "  set_digital_out(6, True)\n  sleep(60)\nend\n"
        )
        body = primary.message(2)
        assert body[5:9] == bytes([0, 0, 1, 4])
        assert body[9:] == b"Surego on?"
        time.sleep(0.3)
        assert dashboard.ask("programState").startswith("PAUSED")

        def out():
            return struct.unpack_from(">II", primary.state()[3])[1] >> 6 & 1

        assert out() == 0
        dashboard.ask(request_)
        assert until(lambda: dashboard.ask("programState").startswith("PLAYING"))
        assert until(out)


def test_a_program_that_pauses_itself_goes_no_further(arm, dashboard):
    with Primary(arm.host) as primary:
        primary.send('def rest():\n  pause\n  textmsg("on")\n  sleep(60)\nend\n')
        assert until(lambda: dashboard.ask("programState").startswith("PAUSED"))
        dashboard.ask("play")
        assert primary.message(0) == b"on"


@pytest.mark.parametrize(
    ("call", "text"),
    [
        ("speedl([0, 0, 0.02, 0, 0, 0], a=0.5, t_min=1.0)", "speedl() got an unexpected keyword argument 't_min'"),
        ("speedl([0, 0, 0.1, 0, 0, 0], 1, 1, 1, 1, 1)", "speedl() takes from 1 to 4 arguments but 6 were given"),
        ("x = 1 / 0", "division by zero"),
    ],
)
def test_an_error_of_a_script_is_stated_in_the_terms_of_scripts(arm, call, text):
    with Primary(arm.host) as primary:
        primary.send(f"def wrong():\n  {call}\nend\n")
        assert primary.message(10)[8:].decode() == f"runtime_error: {text}"


def test_replies_are_those_that_drivers_compare(arm, dashboard):
    assert (
        dashboard.ask("clear operational mode")
        == "No longer controlling the operational mode. Current operational mode: 'NONE'."
    )
    assert dashboard.ask("load installation default.installation") == "Loading installation: default.installation"
    assert dashboard.ask("load installation missing.installation") == "File not found: missing.installation"
