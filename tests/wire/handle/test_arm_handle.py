"""`lsds.testing.wire_mock` with the UR5e, driven by ur_rtde and by a plain dashboard client."""

from __future__ import annotations

import contextlib
import socket
import time

import pytest

from lsds.testing import wire_mock
from tests.wire.ur.arms import Dashboard
from tests.wire.waiting import until

READY_S = 2.0
"""Limit of the start, s."""


@pytest.fixture(scope="module")
def served():
    with wire_mock("ur5e") as mock:
        yield mock
        assert mock.process.complaints == ""


@pytest.fixture
def mock(served):
    served.mark()
    return served


def test_two_arms_start_in_time_at_addresses_of_their_own():
    start = time.monotonic()
    with wire_mock("ur5e") as one, wire_mock("ur5e", transport="dashboard") as other:
        assert time.monotonic() - start < 2 * READY_S
        assert one.host != other.host
        assert (one.port, other.port) == (30004, 29999)


def test_ur_rtde_moves_and_a_freeze_is_over_with_its_block(mock):
    rtde_receive = pytest.importorskip("rtde_receive", reason="ur_rtde is not installed: pip install ur_rtde")
    rtde_control = pytest.importorskip("rtde_control")
    receive = rtde_receive.RTDEReceiveInterface(mock.host)
    control = rtde_control.RTDEControlInterface(mock.host)
    try:
        pose = receive.getActualTCPPose()
        assert mock.truth.pose == pytest.approx(pose, abs=1e-6)
        assert control.speedL([0, 0, 0.05, 0, 0, 0], 0.5, 1.0)
        assert until(lambda: mock.truth.moving and mock.truth.speed_m_s > 0.04)
        mock.mark()
        with pytest.raises(AssertionError, match=r"ur5e still moved 0\.1.. s after .*input_double_register_2=0.05"):
            mock.stopped_within(0.1)
        control.speedStop()
        mock.mark()
        mock.stopped_within(0.5)
        stamp = receive.getTimestamp()
        with mock.fault("freeze"):
            time.sleep(0.1)
            frozen = receive.getTimestamp()
            time.sleep(0.1)
            assert receive.getTimestamp() == frozen
        assert until(lambda: receive.getTimestamp() > max(stamp, frozen))
        meanings = [frame.meaning for frame in mock.received if frame.face == "rtde"]
        assert meanings[0] == "request version 2"
        assert any(text.startswith("set-up outputs: ") and "actual_TCP_pose" in text for text in meanings)
        assert any(text.startswith("input: input_int_register") for text in meanings)
        assert any(frame.face in ("primary", "secondary", "real-time") for frame in mock.received)
    finally:
        control.stopScript()
        control.disconnect()
        receive.disconnect()


def test_ports_come_back_when_a_disconnect_ends(mock):
    with mock.fault("disconnect"), pytest.raises(OSError):
        socket.create_connection((mock.host, 29999), 1)
    with Dashboard(mock.host) as dashboard:
        assert dashboard.ask("robotmode") == "Robotmode: RUNNING"


def test_a_busy_port_is_free_when_the_fault_ends(mock):
    with mock.fault("busy", face="dashboard"), socket.create_connection((mock.host, 29999), 1) as link:
        assert link.recv(100) == b""
    with Dashboard(mock.host) as dashboard:
        assert dashboard.greeting.startswith("Connected")


def test_the_second_question_is_lost(mock):
    with Dashboard(mock.host) as dashboard, mock.fault("drop", face="dashboard", when="robotmode", nth=2, count=1):
        assert dashboard.ask("robotmode") == "Robotmode: RUNNING"
        dashboard.socket.settimeout(0.3)
        with pytest.raises(TimeoutError):
            dashboard.ask("robotmode")
        assert dashboard.ask("running") == "Program running: false"
    assert [frame.meaning for frame in mock.received[-3:]] == ["robotmode", "robotmode", "running"]
    assert mock.received[-1].data == b"running\n"


def test_a_protective_stop_strikes_at_the_program_that_is_sent():
    with wire_mock("ur5e") as mock, socket.create_connection((mock.host, 30001)) as primary:
        with mock.fault("protective-stop", when="def lift", count=1):
            primary.sendall(b"def lift():\n  speedl([0, 0, 0.1, 0, 0, 0], 0.5, 5)\nend\n")
            assert until(lambda: mock.truth.safety == "PROTECTIVE_STOP")
            mock.stopped_within(0.2)
        assert mock.truth.program == "STOPPED"
        assert mock.received[-1].meaning == "def lift():"
        # The fault is over, but a protective stop has to be unlocked.
        assert mock.truth.safety == "PROTECTIVE_STOP"


def test_two_hundred_connections_in_a_row_are_completed_at_once(mock):
    with contextlib.ExitStack() as links:
        start = time.monotonic()
        for _ in range(200):
            links.enter_context(socket.create_connection((mock.host, 29999), 5))
        assert time.monotonic() - start < 0.9  # one that is not queued takes a second more
