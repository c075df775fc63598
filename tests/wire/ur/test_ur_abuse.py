"""Invalid input: NaN, endless sizes, programs that never wait, clients that do not read."""

from __future__ import annotations

import contextlib
import math
import socket
import struct
import threading
import time
from pathlib import Path

import pytest
from lsds_mocks.wire.ur.controller import Controller
from lsds_mocks.wire.ur.environment import Environment
from lsds_mocks.wire.ur.functions import Library, waiting
from lsds_mocks.wire.ur.messages import RuntimeExceptionMessage
from lsds_mocks.wire.ur.modes import SafetyMode
from lsds_mocks.wire.ur.options import UrOptions
from lsds_mocks.wire.ur.primary import robot_state
from lsds_mocks.wire.ur.realtime import package
from lsds_mocks.wire.ur.script.compiler import compile_script
from lsds_mocks.wire.ur.variables import IN, output_type, packer

from lsds.errors import ConfigError
from lsds.registry.options import validated
from tests.wire.ur.arms import Primary
from tests.wire.ur.rtde_client import Client

EVERY_OUTPUT = [
    *(name for name in IN if output_type(name)),
    *(f"output_{kind}_register_{i}" for kind in ("int", "double") for i in range(48)),
    *(f"output_bit_register_{i}" for i in range(64, 128)),
    "timestamp",
    "target_q",
    "target_qd",
    "target_qdd",
    "actual_q",
    "actual_qd",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "payload_cog",
    "payload_inertia",
    "target_gravity",
    "actual_digital_output_bits",
    "tool_output_voltage",
    "speed_scaling",
    "elbow_position",
    "standard_analog_output0",
    "tcp_offset",
]


def run(body, cycles=100):
    """A program's end, with NaN in input register 0 and infinity in 1; everything is packed for clients each cycle."""
    controller = Controller(UrOptions(), Environment(), Library)
    controller.inputs.doubles[:2] = [math.nan, math.inf]
    controller.start(compile_script(f"def p():\n{body}\nend\n", waiting()))
    pack = packer(EVERY_OUTPUT, b"U\x01")
    for _ in range(cycles):
        controller.cycle()
        pack(controller)
        robot_state(controller)
        package(controller)
    assert all(map(math.isfinite, [*controller.arm.q, *controller.tcp_pose, *controller.tcp_force]))
    return controller, [m.text for m in controller.messages if isinstance(m, RuntimeExceptionMessage)]


@pytest.mark.parametrize(
    "body",
    [
        "movej([n, n, n, n, n, n])",
        "movej([i, 0, 0, 0, 0, 0])",
        "movej([0, -1.5, 1.5, 0, 0, 0], v=n)",
        "movej([0, -1.5, 1.5, 0, 0, 0], v=-1)",
        "movej([0, -1.5, 1.5, 0, 0, 0], a=0)",
        "movel(p[n, 0, 0, 0, 0, 0])",
        "movel(get_actual_tcp_pose(), a=i)",
        "movec(p[i, 0, 0, 0, 0, 0], p[0, 0, 0, 0, 0, 0])",
        "speedj([n, 0, 0, 0, 0, 0], 1, 1)",
        "speedj([0.1, 0, 0, 0, 0, 0], n, 1)",
        "speedl([0, 0, n, 0, 0, 0], 1, 1)",
        "servoj([n, n, n, n, n, n])",
        "set_tcp(p[0, 0, 0, i, 0, 0])",
        "set_tcp(p[0, 0, 0, 1e300, 0, 0])",
        "set_tcp([0, 0, 0])",
        "set_payload(1, [0, 0])",
        "set_payload(n)",
        "set_target_payload(1, [0, 0, 0], [1, 2])",
        "set_gravity([1])",
        "force_mode(p[0, 0, 0, 0, 0, 0], [0, 1], [0, 0, 0, 0, 0, 0], 2, [1, 1, 1, 1, 1, 1])",
        "force_mode(p[0, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, n, 0, 0, 0], 2, [1, 1, 1, 1, 1, 1])",
        "force_mode(p[0, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0], 2, [1])",
        "set_standard_digital_out(70, True)",
        "set_configurable_digital_out(-9, True)",
        "set_standard_analog_out(2, 0.5)",
        "set_tool_voltage(100000000000)",
        "write_output_boolean_register(100000000000, True)",
        "write_output_float_register(-1, 1)",
        "make_list(2000000000, 0)",
    ],
)
def test_numbers_that_cannot_be_end_the_program_and_nothing_else(body):
    controller, messages = run(f"n = read_input_float_register(0)\ni = read_input_float_register(1)\n{body}\nsleep(9)")
    assert len(messages) == 1
    assert controller.program is None
    assert controller.safety is SafetyMode.NORMAL
    assert not controller.arm.moving


@pytest.mark.parametrize("parameters", ["n, 300", "0.1, n"])
def test_what_is_no_number_never_gets_into_the_joints(parameters):
    target = "[-1.6, -1.7, -2.2, -0.8, 1.6, 0]"
    controller, _ = run(f"n = read_input_float_register(0)\nservoj({target}, 0, 0, 0.1, {parameters})\nstopj(n)")
    assert all(abs(q) < 7 for q in controller.arm.q)


@pytest.mark.parametrize("nothing", [math.nan, math.inf, -math.inf])
def test_inputs_that_are_no_numbers_change_neither_slider_nor_forces_nor_outputs(nothing):
    controller, _ = run("sleep(9)")
    controller.feed({"speed_slider_mask": 1, "speed_slider_fraction": nothing})
    controller.feed({"external_force_torque": [nothing] * 6})
    controller.feed({"standard_analog_output_mask": 1, "standard_analog_output_0": nothing})
    controller.cycle()
    assert 0 <= controller.scaling <= 1
    assert 0 <= controller.io.analog[0] <= 1
    assert controller.tcp_force == [0.0] * 6


def test_options_are_numbers():
    with pytest.raises(ConfigError):
        validated(UrOptions, {"q_rad": [math.nan] * 6}, "ur5e")


@pytest.mark.parametrize(
    "body",
    [
        "i = 0\nwhile i < 10000:\n  j = 0\n  while j < 10000:\n    j = j + 1\n  end\n  i = i + 1\nend",
        "def f(n):\n  if n < 2:\n    return n\n  end\n  return f(n - 1) + f(n - 2)\nend\nf(60)",
        "def f():\n  f()\nend\nf()",
        "thread t():\n  run t()\nend\nrun t()\nsleep(9)",
        "thread t():\n  run t()\n  run t()\n  sync()\nend\nrun t()\nsleep(9)",
        's = "aaaaaaaa"\nwhile True:\n  s = str_cat(s, s)\nend',
        "l = [1]\nwhile True:\n  l.append(1)\n  l.append(1)\nend",
        "def f(a=b):\n  return a\nend\nb = 1\nf()",
        "def f(a=1 / 0):\n  return a\nend\nf()",
    ],
)
def test_a_program_that_never_waits_or_grows_without_end_is_ended(body):
    began = time.monotonic()
    controller, messages = run(body, cycles=20)
    assert len(messages) == 1
    assert controller.program is None
    assert time.monotonic() - began < 5


@pytest.mark.parametrize("body", ["kill h\nsleep(1)", "kill h\nwhile True:\n  sync()\nend", "join h"])
def test_a_thread_may_end_itself_or_wait_for_itself(body):
    controller, messages = run(f"global h = 0\nthread t():\n{body}\nend\nh = run t()\nsleep(0.1)")
    assert messages == []
    assert controller.program is None


def test_a_list_of_lists_is_made_of_copies():
    _, messages = run("l = make_list(2, [0, 0])\nl[0][0] = 1\nif l[1][0] != 0:\n  x = 1 / 0\nend")
    assert messages == []


# -- on the wire ----------------------------------------------------------------------------------------------


@contextlib.contextmanager
def undisturbed(host, longest_s=0.5):
    """The stream continues without a loss and without a long gap during the body."""
    with Client(host) as client:
        client.outputs("timestamp")
        client.start()
        gaps, steps, stop = [], [], threading.Event()

        def listen():
            before, stamp = time.monotonic(), client.sample()["timestamp"]
            while not stop.is_set():
                sample = client.sample()["timestamp"]
                now = time.monotonic()
                gaps.append(now - before)
                steps.append(sample - stamp)
                before, stamp = now, sample

        listener = threading.Thread(target=listen)
        listener.start()
        try:
            yield
            time.sleep(0.1)
        finally:
            stop.set()
            listener.join(10)
        assert not listener.is_alive()
        assert steps == pytest.approx([0.002] * len(steps), abs=1e-6)
        assert max(gaps) < longest_s


def memory_mb(process):
    return int(Path(f"/proc/{process.pid}/statm").read_text().split()[1]) * 4096 / 1e6


def test_a_rate_next_to_nothing_is_refused(host):
    with undisturbed(host), Client(host) as client:
        number, _ = client.outputs("timestamp", rate=5e-324)
        assert number == 0


def test_every_output_at_once_is_served(host):
    with Client(host) as client:
        number, types = client.outputs(*EVERY_OUTPUT)
        assert (number, "NOT_FOUND" in types) == (1, False)
        assert len(",".join(EVERY_OUTPUT)) > 4096
        assert client.start()
        assert client.sample()["actual_q"]


def test_a_recipe_whose_packages_would_be_too_long_is_refused(host):
    with undisturbed(host), Client(host) as client:
        number, _ = client.outputs(*["actual_q"] * 2000)
        assert number == 0
        assert not client.start()


def test_there_are_no_more_input_recipes_than_a_byte_can_number(host):
    with undisturbed(host), Client(host) as client:
        numbers = [client.inputs("input_int_register_1")[0] for _ in range(260)]
    assert numbers == [*range(1, 256), 0, 0, 0, 0, 0]


@pytest.mark.parametrize(("port", "request_"), [(29999, b"PolyscopeVersion\n"), (30004, b"\x00\x03v")])
def test_a_client_that_asks_and_never_reads_is_thrown_out(arm, host, port, request_):
    before = memory_mb(arm)
    with undisturbed(host), socket.socket() as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        client.settimeout(5)
        client.connect((host, port))
        deadline = time.monotonic() + 20
        with contextlib.suppress(ConnectionError):
            while time.monotonic() < deadline:
                client.sendall(request_ * 1000)
            raise AssertionError("it accepts requests without end")
    assert memory_mb(arm) - before < 40


def test_clients_that_only_listen_and_never_read_lose_what_is_new_and_nothing_else(host):
    with contextlib.ExitStack() as stack:
        for port in (30001, 30003, 30003):
            stack.enter_context(socket.create_connection((host, port), 5))
        deaf = stack.enter_context(Client(host))
        deaf.outputs("timestamp", *["actual_q"] * 200)
        deaf.start()
        with undisturbed(host):
            time.sleep(1.5)
        # In the end it receives whole packages.
        for _ in range(500):
            assert deaf.sample()["actual_q"]


@pytest.mark.parametrize("text", [b"x" * 65536, b"x = 1\n" * 8000, b"def f():\n" + b"  if True:\n" * 5000])
def test_scripts_without_end_are_refused(arm, host, text):
    before = memory_mb(arm)
    with undisturbed(host, 1.0), socket.create_connection((host, 30002), 5) as client:
        client.settimeout(5)
        deadline = time.monotonic() + 1
        while time.monotonic() < deadline:
            client.sendall(text)
    assert memory_mb(arm) - before < 100


@pytest.mark.parametrize(
    "body",
    [
        "x = " + "9" * 5000,
        "x = " + "(" * 300 + "1" + ")" * 300,
        "while True:\n" * 30 + "sync()\n" + "end\n" * 30,
        "if True:\n" * 200 + "sync()\n" + "end\n" * 200,
        "x = struct(a=1, a=2)",
        "def f(a, a):\n  return a\nend",
        "def f(a=sleep(1)):\n  return a\nend",
    ],
)
def test_a_compile_error_is_reported_and_the_next_program_runs(host, body):
    with Primary(host) as primary:
        primary.send(f"def bad():\n{body}\nend\n")
        assert primary.message(10)
        primary.send("def good():\n  sync()\nend\n")
        assert primary.message(7)


def test_a_program_whose_peer_sends_without_end_goes_on(arm, host):
    before = memory_mb(arm)
    with socket.create_server(("127.0.0.1", 0)) as server, Primary(host) as primary:
        server.settimeout(5)
        opened = f'socket_open("127.0.0.1", {server.getsockname()[1]})'
        with undisturbed(host):
            primary.send(f'def p():\n{opened}\nsocket_read_line(timeout=1)\ntextmsg("on")\nend\n')
            link, _ = server.accept()
            with link, contextlib.suppress(OSError):
                while True:
                    link.sendall(b"y" * 65536)
        assert primary.message(0) == b"on"
    assert memory_mb(arm) - before < 40


def test_sizes_that_lie_end_the_connection_only(host):
    with undisturbed(host), socket.create_connection((host, 30004), 5) as client:
        client.settimeout(5)
        client.sendall(struct.pack(">HB", 2, ord("V")))
        assert client.recv(100) == b""
