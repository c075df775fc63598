"""The controller's ports, with clients of our own: RTDE, dashboard, primary, real-time."""

from __future__ import annotations

import itertools
import random
import socket
import struct
import time

import pytest
from lsds_mocks.mock_process import MockProcess

from lsds.errors import ConnectFailed
from tests.wire.ur.arms import Dashboard, Primary
from tests.wire.ur.rtde_client import Client

# -- RTDE -----------------------------------------------------------------------------------------------------


def test_versions_are_negotiated(host):
    with Client(host, version=None) as client:
        for version, accepted in ((1, b"\x01"), (2, b"\x01"), (3, b"\x00"), (0, b"\x00")):
            assert client.ask("V", struct.pack(">H", version)) == accepted
        assert struct.unpack(">4I", client.ask("v")) == (5, 19, 0, 1210631)


@pytest.mark.parametrize(("version", "number"), [(2, 1), (1, None)])
def test_outputs_come_at_500_hz_with_exact_steps(host, version, number):
    with Client(host, version) as client:
        assert client.outputs("timestamp", "actual_q", "robot_mode") == (number, ["DOUBLE", "VECTOR6D", "INT32"])
        assert client.start()
        samples = [client.sample() for _ in range(200)]
        steps = {round((b["timestamp"] - a["timestamp"]) * 1e9) for a, b in itertools.pairwise(samples)}
        assert steps == {2_000_000}
        assert samples[0]["timestamp"] > 100
        assert samples[-1]["robot_mode"] == 7
        assert client.pause()


def test_a_lower_rate_sends_every_nth_cycle(host):
    with Client(host) as client:
        client.outputs("timestamp", rate=25.0)
        client.start()
        times = [client.sample()["timestamp"] for _ in range(4)]
        assert [b - a for a, b in itertools.pairwise(times)] == pytest.approx([0.04] * 3, abs=1e-6)


@pytest.mark.parametrize("rate", [0.0, -1.0, 1000.0, float("nan")])
def test_an_impossible_rate_is_refused(host, rate):
    with Client(host) as client:
        number, _ = client.outputs("timestamp", rate=rate)
        assert number == 0
        assert not client.start()


def test_an_unknown_output_is_named_and_start_fails(host):
    with Client(host) as client:
        assert client.outputs("timestamp", "no_such_thing") == (0, ["DOUBLE", "NOT_FOUND"])
        assert not client.start()
        # The connection goes on: the next recipe counts.
        assert client.outputs("timestamp,") == (1, ["DOUBLE"])
        assert client.start()


def test_an_input_belongs_to_one_connection_until_it_closes(host):
    names = ("input_int_register_30", "input_double_register_30")
    with Client(host) as first, Client(host) as second:
        assert first.inputs(*names) == (1, ["INT32", "DOUBLE"])
        assert first.inputs(names[0]) == (2, ["INT32"])
        assert second.inputs(*names) == (0, ["IN_USE", "IN_USE"])
        assert second.inputs("input_int_register_31", "nonsense") == (0, ["INT32", "NOT_FOUND"])
        first.socket.close()
        deadline = time.monotonic() + 3
        while second.inputs(*names)[0] == 0:
            assert time.monotonic() < deadline


def test_inputs_arrive_can_be_read_back_and_too_much_is_cut_off(host):
    with Client(host) as client:
        client.outputs("input_int_register_32", "input_double_register_32", "input_bit_register_70")
        recipe, _ = client.inputs("input_int_register_32", "input_double_register_32", "input_bit_register_70")
        client.start()
        client.write(recipe, "id?8d", -7, 2.5, True, *range(8))
        sample = client.until("input_int_register_32", -7)
        assert (sample["input_double_register_32"], sample["input_bit_register_70"]) == (2.5, True)
        client.write(9, "i", 1)
        assert client.sample()


def test_outputs_of_the_terminals_obey_their_masks(host):
    with Client(host) as client:
        client.outputs(
            "actual_digital_output_bits", "standard_analog_output0", "analog_io_types", "target_speed_fraction"
        )
        digital, _ = client.inputs("standard_digital_output_mask", "standard_digital_output")
        analog, _ = client.inputs(
            "standard_analog_output_mask", "standard_analog_output_type", "standard_analog_output_0"
        )
        slider, _ = client.inputs("speed_slider_mask", "speed_slider_fraction")
        client.start()
        client.write(digital, "BB", 0b0110, 0b0010)
        client.until("actual_digital_output_bits", 0b0010)
        client.write(digital, "BB", 0b0110, 0b0100)
        client.until("actual_digital_output_bits", 0b0100)
        client.write(analog, "BBd", 1, 1, 0.25)
        client.until("standard_analog_output0", 2.5)
        client.write(analog, "BBd", 1, 0, 0.5)
        client.until("standard_analog_output0", 0.004 + 0.5 * 0.016)
        client.write(slider, "Id", 1, 0.5)
        client.until("target_speed_fraction", 0.5)
        client.write(slider, "Id", 1, 1.0)
        client.until("target_speed_fraction", 1.0)
        client.write(digital, "BB", 0xFF, 0)


def test_several_clients_are_served_alike(host):
    clients = [Client(host) for _ in range(4)]
    try:
        for client in clients:
            client.outputs("timestamp", "actual_TCP_pose")
            client.start()
        first = [[client.sample()["timestamp"] for _ in range(50)] for client in clients]
        assert all(times[-1] - times[0] == pytest.approx(0.098) for times in first)
    finally:
        for client in clients:
            client.socket.close()


def test_no_bytes_disturb_the_others(host):
    rng = random.Random(0)
    with Client(host) as good:
        good.outputs("timestamp")
        good.start()
        before = good.sample()["timestamp"]
        for port in (29999, 30001, 30002, 30003, 30004):
            for _ in range(5):
                with socket.create_connection((host, port), 5) as bad:
                    bad.sendall(rng.randbytes(rng.randrange(1, 3000)) + b"\n")
        after = [good.sample()["timestamp"] for _ in range(100)][-1]
        assert after - before > 0.19


# -- dashboard ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        ("PolyscopeVersion", "URSoftware 5.19.0.1210631 (Apr 29 2024)"),
        ("version", "5.19.0.1210631"),
        ("get serial number", "20235501234"),
        ("get robot model", "UR5"),
        ("is in remote control", "true"),
        ("robotmode", "Robotmode: RUNNING"),
        ("safetymode", "Safetymode: NORMAL"),
        ("safetystatus", "Safetystatus: NORMAL"),
        ("running", "Program running: false"),
        ("popup hello", "showing popup"),
        ("close popup", "closing popup"),
        ("close safety popup", "closing safety popup"),
        ("addToLog text", "Added log message"),
        ("addToLog", "No log message to add"),
        ("load nothing.urp", "File not found: nothing.urp"),
        ("load installation default.installation", "Loading installation: default.installation"),
        ("saveLog", "Log saved to disk"),
        ("frobnicate", 'could not understand: "frobnicate"'),
    ],
)
def test_the_dashboard_answers_as_clients_compare(host, request_, reply):
    with Dashboard(host) as dashboard:
        assert dashboard.greeting == "Connected: Universal Robots Dashboard Server"
        assert dashboard.ask(request_) == reply


def eventually(ask, expected, timeout_s=5.0):
    deadline = time.monotonic() + timeout_s
    while (answer := ask()) != expected:
        assert time.monotonic() < deadline, answer
        time.sleep(0.02)


def test_power_walks_from_off_to_running_and_programs_play_pause_and_stop(host):
    with Dashboard(host) as d:
        assert d.ask("power off") == "Powering off"
        eventually(lambda: d.ask("robotmode"), "Robotmode: POWER_OFF")
        assert d.ask("load wait_program.urp") == "Loading program: /programs/wait_program.urp"
        assert d.ask("play") == "Failed to execute: play"
        assert d.ask("power on") == "Powering on"
        eventually(lambda: d.ask("robotmode"), "Robotmode: IDLE")
        assert d.ask("brake release") == "Brake releasing"
        eventually(lambda: d.ask("robotmode"), "Robotmode: RUNNING")
        assert d.ask("programState") == "STOPPED wait_program.urp"
        assert d.ask("play") == "Starting program"
        eventually(lambda: d.ask("programState"), "PLAYING wait_program.urp")
        assert d.ask("pause") == "Pausing program"
        assert d.ask("programState") == "PAUSED wait_program.urp"
        assert d.ask("play") == "Starting program"
        assert d.ask("running") == "Program running: true"
        assert d.ask("stop") == "Stopped"
        assert d.ask("programState") == "STOPPED wait_program.urp"
        assert d.ask("quit") == "Disconnected"
        with pytest.raises(EOFError):
            d.line()


def test_manual_mode_takes_remote_control_away(host):
    with Dashboard(host) as d:
        assert d.ask("set operational mode manual") == "Operational mode 'MANUAL' is set"
        assert d.ask("is in remote control") == "false"
        assert d.ask("clear operational mode").startswith("No longer controlling the operational mode.")
        assert d.ask("get operational mode") == "NONE"
        d.ask("set operational mode automatic")
        assert d.ask("is in remote control") == "true"
        d.ask("clear operational mode")


# -- script ports ---------------------------------------------------------------------------------------------


def test_the_primary_interface_reports_programs(host):
    with Primary(host) as primary:
        version = primary.message(3)
        assert version[1 : 1 + version[0]] == b"URControl"
        primary.send('def test_fun():\n  textmsg("still running")\n  sleep(0.1)\n  sync()\nend\n')
        assert b"PROGRAM_XXX_STARTED" in (started := primary.message(7))
        assert started.endswith(b"test_fun")
        assert primary.message(0) == b"still running"
        assert b"PROGRAM_XXX_STOPPED" in primary.message(7)
        primary.send("def illegal_fun():\n  calldoesntexist()\nend\n")
        failure = primary.message(10)
        assert struct.unpack_from(">II", failure) == (2, 3)
        assert failure[8:] == b"compile_error_name_not_found:calldoesntexist:"


def test_the_state_has_all_its_parts_in_their_sizes(host):
    with Primary(host) as primary:
        parts = primary.state()
    sizes = {0: 42, 1: 246, 2: 32, 3: 75, 4: 96, 5: 220, 6: 440, 7: 56}
    assert {number: len(parts[number]) for number in (0, 1, 4)} == {0: 42, 1: 246, 4: 96}
    assert set(parts) == set(sizes)
    checksums = struct.unpack_from(">6I", parts[5])
    assert all(checksums)
    assert struct.unpack_from(">6d", parts[5], 24 + 48)[1:3] == (-0.425, -0.3922)
    assert struct.unpack_from(">i", parts[6], len(parts[6]) - 12)[0] == 1


def test_read_only_ports_run_nothing(host):
    with Primary(host, 30011) as watcher, Primary(host) as primary:
        watcher.send('textmsg("no")\n')
        primary.send('textmsg("yes")\n')
        assert watcher.message(0) == b"yes"


def test_the_realtime_stream_has_its_fixed_size_and_steps(host):
    with socket.create_connection((host, 30013), 5) as link:
        data = b""
        while len(data) < 1220 * 20:
            data += link.recv(65536)
    packages = [data[i : i + 1220] for i in range(0, 1220 * 20, 1220)]
    assert {struct.unpack_from(">i", p)[0] for p in packages} == {1220}
    times = [struct.unpack_from(">d", p, 4)[0] for p in packages]
    assert [b - a for a, b in itertools.pairwise(times)] == pytest.approx([0.002] * 19)
    pose = struct.unpack_from(">6d", packages[-1], 444)
    assert abs(pose[0]) < 1
    assert struct.unpack_from(">d", packages[-1], 756)[0] == 7.0


def test_a_protective_stop_is_reported_once_and_refuses_programs_until_it_is_unlocked(host):
    with Primary(host) as primary, Dashboard(host) as d:
        primary.send("sec setup():\n protective_stop()\nend\n")
        code, argument, level = struct.unpack_from(">3i", primary.message(6))
        assert (code, argument, level) == (209, 0, 2)
        assert primary.state()[0][12] == 1
        assert d.ask("safetystatus") == "Safetystatus: PROTECTIVE_STOP"
        assert d.ask("unlock protective stop").startswith("Cannot unlock protective stop until 5s after occurrence.")
        primary.send("def refused():\n  sync()\nend\n")
        assert b"refused is not started" in primary.message(10)
        primary.send("set unlock protective stop\n")
        assert b"until 5s after occurrence" in primary.message(0)
        # A refused request is not executed later; a repeated one is.
        time.sleep(5.2)
        assert d.ask("safetymode") == "Safetymode: PROTECTIVE_STOP"
        assert primary.state()[0][12] == 1
        primary.send("set unlock protective stop\n")
        assert primary.message(5)[8] == 1
        assert d.ask("safetymode") == "Safetymode: NORMAL"
        assert d.ask("unlock protective stop") == "Protective stop releasing"


def test_a_script_talks_to_another_computer_and_hangs_up_when_it_ends(host):
    """The pattern of external control: sockets, threads, timeouts."""
    with socket.create_server((host, 0)) as server, Primary(host) as primary:
        server.settimeout(5)
        primary.send(
            f"""def external():
  mode = 0
  thread moves():
    while mode == 1:
      speedj([0.05, 0, 0, 0, 0, 0], 2.0, 0.002)
    end
    stopj(4)
  end
  opened = socket_open("{host}", {server.getsockname()[1]}, "reverse")
  mover = 0
  timeout = 0
  while mode > -1:
    enter_critical
    message = socket_read_binary_integer(2, "reverse", timeout)
    if message[0] > 0:
      timeout = message[1] / 1000
      if mode != message[2]:
        mode = message[2]
        join mover
        if mode == 1:
          mover = run moves()
        end
      end
      socket_send_int(mode, "reverse")
    else:
      mode = -1
      join mover
    end
    exit_critical
  end
end
"""
        )
        link, _ = server.accept()
        with link, Client(host) as rtde:
            link.settimeout(5)
            rtde.outputs("actual_qd")
            rtde.start()
            for mode in (1, 0, 1):
                link.sendall(struct.pack(">ii", 200, mode))
                assert struct.unpack(">i", link.recv(4)) == (mode,)
            moving = [rtde.sample()["actual_qd"][0] for _ in range(60)]
            assert max(moving) == pytest.approx(0.05)
            # After silence for the configured time it stops by itself and disconnects.
            assert link.recv(4) == b""
            resting = [rtde.sample()["actual_qd"][0] for _ in range(60)]
            assert resting[-1] == 0.0


def test_an_address_is_taken_once(host):
    with pytest.raises(ConnectFailed, match="another mock may use it; give each arm its own address"):
        MockProcess("ur5e", {"host": host}).start()


def test_only_loopback_is_served():
    with pytest.raises(ConnectFailed, match="not an address of the loopback interface"):
        MockProcess("ur5e", {"host": "192.0.2.1"}).start()
