"""Who may send programs, how large they may be, and what they may reach."""

from __future__ import annotations

import contextlib
import socket
import threading

import pytest
from lsds_mocks.mock_process import MockProcess
from lsds_mocks.wire.ur.functions import waiting
from lsds_mocks.wire.ur.script.compiler import compile_script
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.parser import MOST_NESTED
from lsds_mocks.wire.ur.script.stream import ScriptStream
from lsds_mocks.wire.ur.sender import Sender, listening_ports, sender_of

from lsds.errors import DeviceError
from tests.wire.ur.abusive_scripts import DEEP
from tests.wire.ur.arms import Dashboard, Primary, fresh_host
from tests.wire.ur.test_ur_abuse import memory_mb, undisturbed

LOGS = 'def p():\n  textmsg("ran")\nend\n'
POSTED = f"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Type: text/plain\r\n\r\n{LOGS}"


# -- HTTP -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("port", [30001, 30002, 30003])
@pytest.mark.parametrize("pieces", [1, 40])
def test_the_body_of_an_http_request_is_not_run(host, port, pieces):
    with Primary(host, 30011) as watcher, socket.create_connection((host, port), 5) as browser:
        browser.settimeout(5)
        size = -(-len(POSTED) // pieces)
        with contextlib.suppress(OSError):
            for at in range(0, len(POSTED), size):
                browser.sendall(POSTED[at : at + size].encode())
        with contextlib.suppress(ConnectionError):
            while browser.recv(65536):
                pass
        # The program sent afterwards is the first that runs.
        with Primary(host) as primary:
            primary.send('textmsg("after")\n')
            assert watcher.message(0) == b"after"


def test_the_dashboard_executes_nothing_of_an_http_request(host):
    with Dashboard(host) as browser, Dashboard(host) as other:
        browser.socket.sendall(b"POST /play HTTP/1.1\r\nHost: a\r\n\r\nset operational mode manual\n")
        with pytest.raises((EOFError, ConnectionError)):
            browser.line()
        assert other.ask("get operational mode") == "NONE"


@pytest.mark.parametrize("size", [3000, 700_000])
def test_a_long_target_hides_no_http_request(size):
    stream = ScriptStream()
    for piece in (f"POST /{'a' * size}", " HTTP/1.1\r\nHost: a\r\n\r\n", LOGS):
        assert stream.feed(piece.encode()) == []
    assert stream.refused


# -- sockets --------------------------------------------------------------------------------------------------


def opens(port, host):
    return f'def p():\n  textmsg(str_cat("opened ", socket_open("{host}", {port})))\nend\n'


def test_a_program_reaches_its_sender_and_no_other_process(host):
    with MockProcess("hand-e", {"urcap_port": 0}) as stranger, Primary(host) as primary:
        strange = int(stranger.addresses["urcap"].rpartition(":")[2])
        primary.send(opens(strange, "127.0.0.1"))
        assert b"--socket-ports" in primary.message(0)
        assert primary.message(0) == b"opened False"
        with socket.create_server((host, 0)) as server:
            primary.send(opens(server.getsockname()[1], host))
            assert primary.message(0) == b"opened True"


def test_an_option_names_the_ports(host):
    with socket.create_server(("127.0.0.1", 0)) as allowed, socket.create_server(("127.0.0.1", 0)) as other:
        ports = [server.getsockname()[1] for server in (allowed, other)]
        options = {"host": fresh_host(), "socket_ports": [ports[0]]}
        with MockProcess("ur5e", options) as arm, Primary(arm.addresses["primary"].split(":")[0]) as primary:
            primary.send(opens(ports[0], "127.0.0.1"))
            assert primary.message(0) == b"opened True"
            primary.send(opens(ports[1], "127.0.0.1"))
            assert b"not allowed" in primary.message(0)
            assert primary.message(0) == b"opened False"


def test_ports_of_the_process_at_the_other_end():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with socket.create_connection(("127.0.0.1", port)) as client:
            accepted, _ = server.accept()
            with accepted:
                assert port in listening_ports(sender_of(accepted))
        assert sender_of(client) is None
    assert listening_ports(Sender(("127.0.0.1", 1), ("127.0.0.1", 2))) == frozenset()


# -- size -----------------------------------------------------------------------------------------------------


def test_an_external_control_script_has_the_size_limit_of_other_programs():
    with socket.create_server(("127.0.0.1", 0)) as server:
        sent = []

        def serve():
            link, _ = server.accept()
            with link, contextlib.suppress(OSError):
                link.recv(100)
                sent.extend(link.send(b"# " + b"x" * ((1 << 20) - 3) + b"\n") for _ in range(300))

        threading.Thread(target=serve, daemon=True).start()
        options = {"host": fresh_host(), "urcap_port": server.getsockname()[1]}
        with MockProcess("ur5e", options) as arm:
            host = arm.addresses["primary"].split(":")[0]
            before = memory_mb(arm)
            with Dashboard(host) as dashboard, Primary(host) as primary, undisturbed(host):
                dashboard.ask("load external_control.urp")
                dashboard.ask("play")
                assert b"at most" in primary.message(10)
            assert memory_mb(arm) - before < 40
        assert sum(sent) < 100e6


def test_what_waits_to_be_fetched_is_limited(host):
    """External Control scripts are requested one after the other; a client that plays on and on gets an error."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        options = {"host": fresh_host(), "urcap_port": server.getsockname()[1]}
        with MockProcess("ur5e", options) as arm:
            address = arm.addresses["primary"].split(":")[0]
            with Dashboard(address) as dashboard, Primary(address) as primary:
                dashboard.ask("load external_control.urp")
                for _ in range(20):
                    dashboard.ask("play")
                assert b"too many programs" in primary.message(10)


# -- nesting --------------------------------------------------------------------------------------------------

NESTED = {
    "brackets": lambda n: "x = " + "(" * n + "1" + ")" * n,
    "lists": lambda n: "x = " + "[" * n + "1" + "]" * n,
    "calls": lambda n: "x = " + "sin(" * n + "1" + ")" * n,
    "minuses": lambda n: "x = " + "- " * n + "1",
    "nots": lambda n: "x = " + "not " * n + "True",
    "branches": lambda n: "if True:\n" * n + "x = 1\n" + "end\n" * n,
}


@pytest.mark.parametrize("nested", NESTED.values(), ids=NESTED)
def test_nesting_is_limited_before_it_is_parsed(nested):
    compile_script(f"def p():\n{nested(MOST_NESTED - 5)}\nend\n", waiting())
    for depth in (MOST_NESTED + 1, DEEP):
        with pytest.raises(ScriptError, match=f"nested more than {MOST_NESTED}"):
            compile_script(f"def p():\n{nested(depth)}\nend\n", waiting())


# -- motion ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("call", ["speedj([0.1, 0, 0, 0, 0, 0], 0, 0.05)", "speedl([0, 0, 0.01, 0, 0, 0], 0, 0.05)"])
def test_a_speed_without_acceleration_keeps_the_speed(host, call):
    with Primary(host) as primary:
        primary.send(f'def p():\n  {call}\n  textmsg("went on")\nend\n')
        assert primary.message(0) == b"went on"


def test_a_speed_is_kept_while_the_acceleration_is_zero(host):
    with Primary(host) as primary:
        primary.send(
            "def p():\n  speedj([0.1, 0, 0, 0, 0, 0], 1, 0.3)\n  speedj([0, 0, 0, 0, 0, 0], 0, 0.1)\n"
            "  textmsg(get_actual_joint_speeds()[0])\n  stopj(4)\nend\n"
        )
        assert float(primary.message(0)) == pytest.approx(0.1, abs=1e-3)


# -- faults ---------------------------------------------------------------------------------------------------


def test_a_fault_of_the_whole_arm_takes_no_face(arm):
    with pytest.raises(DeviceError, match=r"'freeze' does not occur on a face 'rtde'.*whole ur5e"):
        arm.inject("freeze", face="rtde", for_s=0.1)


def test_an_unknown_fault_is_answered_with_the_list(arm):
    with pytest.raises(DeviceError, match=r"'nonsense' is no fault of this mock.*protective-stop"):
        arm.inject("nonsense")
