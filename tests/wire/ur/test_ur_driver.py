"""The arm's driver on the mock's wire: the contract, and everything that can go wrong between the two."""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
import threading

import pytest
from lsds_drivers.ur.packets import Kind, Reply
from lsds_mocks.mock_process import MockProcess

from lsds.clock import NS_PER_S
from lsds.contracts import ArmCommand, BuildContext, Lifecycle, Twist
from lsds.errors import (
    CommandExpired,
    ConnectFailed,
    DeviceError,
    DeviceFault,
    DeviceTimeout,
    LimitExceeded,
    StaleData,
)
from lsds.testing import Bench, cases
from tests.wire.robotiq.rig import CLOCK, HOST, nothing_left
from tests.wire.ur.arms import Dashboard, fresh_host
from tests.wire.ur.rtde_client import Client
from tests.wire.waiting import until

pytest.importorskip("rtde_control")

UP = Twist((0.0, 0.0, 0.03))
CALL_S = 2.0
# A cell must not bear half a second without the driver; a machine that also runs other tests may need it.
OPTIONS: dict = {"watchdog_hz": 2.0}


@pytest.fixture(scope="module", autouse=True)
def mock():
    with MockProcess("ur5e", {"host": fresh_host()}) as mock:
        OPTIONS["host"] = host_of(mock)
        yield mock
        assert mock.complaints == ""


def host_of(mock):
    return mock.addresses["rtde"].partition(":")[0]


def build(mock, **options):
    return HOST.build("arm", "ur5e", {"host": host_of(mock), **options}, BuildContext(CLOCK))


@contextlib.contextmanager
def connected(mock, **options):
    """A connected driver, always closed at the end, with no process or socket left."""
    with nothing_left():
        arm = build(mock, **options)
        try:
            arm.connect()
            yield arm
        finally:
            arm.close()


def up(speed=0.03, within_s=0.1):
    return ArmCommand(Twist((0.0, 0.0, speed)), 1.0, CLOCK.now() + round(within_s * NS_PER_S))


def attempt(call, *arguments):
    """Return the result of a call or its DeviceError; fail if it takes too long or raises another exception."""
    began = CLOCK.now()
    try:
        result = call(*arguments)
    except DeviceError as error:
        result = error
    assert CLOCK.now() - began < CALL_S * NS_PER_S, f"{call.__name__} took {(CLOCK.now() - began) / NS_PER_S:.2f} s"
    assert not isinstance(result, DeviceError) or result.remedy, f"no remedy: {result}"
    return result


def obeys(arm):
    """Whether it can be armed afresh, and takes a command."""
    try:
        arm.disarm()
        arm.arm()
        arm.command(up())
    except DeviceError:
        return False
    return True


def truly_at_rest(mock):
    """Return whether the controller itself reports rest, over a separate connection."""
    with Client(host_of(mock)) as client:
        client.outputs("actual_qd")
        client.start()
        return client.sample()["actual_qd"] == [0.0] * 6


@pytest.mark.parametrize(
    "case", cases(Bench("arm", "ur5e", OPTIONS, HOST, allow_motion=True)), ids=lambda case: case.id
)
def test_conformance(case):
    case()


def test_states_are_fresh_ordered_and_stamped_when_they_were_taken(mock):
    with connected(mock) as arm:
        states = []
        assert until(lambda: states.append(arm.read()) or len({s.seq for s in states}) > 30)
        assert all(a.seq <= b.seq and a.t_ns <= b.t_ns for a, b in itertools.pairwise(states))
        ages_ms = sorted((CLOCK.now() - arm.read().t_ns) / 1e6 for _ in range(50))
        assert ages_ms[0] > -1
        assert ages_ms[25] < 20


def test_it_follows_commands_and_rests_when_they_expire(mock):
    with connected(mock) as arm:
        arm.arm()
        before = arm.read().tcp_pose.position_m[2]
        sent = arm.command(up(within_s=0.3))
        assert sent.twist == UP
        assert until(lambda: abs(arm.read().tcp_twist.linear_m_s[2] - 0.03) < 1e-3)
        assert until(lambda: not any(arm.read().tcp_twist.linear_m_s))
        assert 0.004 < arm.read().tcp_pose.position_m[2] - before < 0.03
    assert arm.lifecycle is Lifecycle.CLOSED


def test_commands_are_limited_and_bad_ones_refused(mock):
    with connected(mock, speed_limit_m_s=0.05, acceleration_limit_m_s2=0.5) as arm:
        arm.arm()
        fast = ArmCommand(Twist((0.0, 3.0, 4.0), (0.0, 0.0, 9.0)), 50.0, CLOCK.now() + NS_PER_S // 20)
        sent = arm.command(fast)
        assert sent.twist.linear_m_s == pytest.approx((0.0, 0.03, 0.04))
        assert sent.twist.angular_rad_s == pytest.approx((0.0, 0.0, 0.5))
        assert sent.acceleration_m_s2 == 0.5
        with pytest.raises(CommandExpired):
            arm.command(up(within_s=-0.1))
        with pytest.raises(LimitExceeded):
            arm.command(up(speed=float("nan")))


def test_no_controller_at_the_address_is_one_clear_error():
    arm = HOST.build("arm", "ur5e", {"host": "127.0.0.254", "connect_timeout_s": 3.0}, BuildContext(CLOCK))
    with nothing_left(), pytest.raises(ConnectFailed, match="check the address"):
        arm.connect()
    assert arm.lifecycle is Lifecycle.NEW


def test_an_arm_without_power_refuses_to_be_armed(mock):
    with Dashboard(host_of(mock)) as dashboard:
        dashboard.ask("power off")
        assert until(lambda: dashboard.ask("robotmode") == "Robotmode: POWER_OFF")
        with connected(mock) as arm:
            with pytest.raises(DeviceFault, match=r"is not running \(robot mode 3\).*power it on") as caught:
                arm.arm()
            assert caught.value.code == 3
            dashboard.ask("brake release")
            assert until(lambda: dashboard.ask("robotmode") == "Robotmode: RUNNING")


def test_registers_in_use_are_one_clear_error(mock):
    with Client(host_of(mock)) as other:
        other.inputs("input_int_register_0")
        with connected(mock) as arm, pytest.raises(DeviceFault, match="is another client in control"):
            arm.arm()


def test_a_protective_stop_is_a_fault_with_a_way_out(mock):
    with connected(mock, unlock_protective_stop=True) as arm:
        arm.arm()
        arm.command(up(within_s=0.5))
        mock.inject("protective-stop", count=1)
        assert until(lambda: arm.read().protective_stop)
        with pytest.raises(DeviceFault, match=r"protective stop.*disarm and arm again"):
            arm.command(up())
        arm.disarm()
        arm.arm()
        assert not arm.read().protective_stop
        arm.command(up())
        assert until(lambda: arm.read().tcp_twist.linear_m_s[2] > 0.01)


def test_an_answer_that_comes_too_late_is_not_taken_for_the_next_one(mock):
    with connected(mock) as arm:
        child, reply = arm._child, Reply("late")
        with pytest.raises(DeviceTimeout):
            child.request(Kind.ARM, 0.0)
        child._publish(reply=reply._replace(request=1))
        assert child.request(Kind.DISARM, CALL_S).problem == ""


def test_a_frozen_process_neither_lets_the_arm_run_on_nor_holds_up_its_driver(mock):
    with connected(mock) as arm:
        arm.arm()
        arm.command(up(within_s=30))
        assert until(lambda: arm.read().tcp_twist.linear_m_s[2] > 0.02)
        os.kill(arm._child.pid, signal.SIGSTOP)
        assert until(lambda: truly_at_rest(mock), 1)
        attempt(arm.stop)
        assert isinstance(attempt(arm.read), StaleData)
        began = CLOCK.now()
        arm.close()
        assert CLOCK.now() - began < 3 * NS_PER_S


def test_a_program_stopped_at_the_pendant_is_a_fault(mock):
    with connected(mock) as arm:
        arm.arm()
        assert until(lambda: not isinstance(attempt(arm.command, up()), DeviceError))
        with Dashboard(host_of(mock)) as dashboard:
            dashboard.ask("stop")
        assert until(lambda: isinstance(attempt(arm.command, up()), DeviceFault))
        arm.disarm()
        arm.arm()
        assert not isinstance(attempt(arm.command, up()), DeviceError)


def test_the_crash_of_its_process_is_one_error_and_the_arm_stops(mock):
    with connected(mock) as arm:
        arm.arm()
        arm.command(up(within_s=30))
        assert until(lambda: arm.read().tcp_twist.linear_m_s[2] > 0.02)
        os.kill(arm._child.pid, signal.SIGSEGV)
        errors = []

        def failed():
            result = attempt(arm.read)
            if isinstance(result, DeviceError) and not isinstance(result, StaleData):
                errors.append(result)
            return bool(errors)

        assert until(failed)
        assert "SIGSEGV" in str(errors[0])
        assert until(lambda: truly_at_rest(mock), 3), "it runs on without its driver"
        assert until(lambda: not isinstance(attempt(arm.read), DeviceError), 8), "it does not come back"
        assert not failed() or len(errors) == 1
        with pytest.raises(DeviceFault, match="disarm and arm again"):
            arm.command(up())
        assert until(lambda: obeys(arm), 10)


def test_a_stream_that_stands_still_is_stale_at_once_and_one_error_before_ur_rtde_crashes(mock):
    with connected(mock) as arm:
        mock.inject("freeze", for_s=3.2)
        assert until(lambda: isinstance(attempt(arm.read), StaleData), 2)
        found = []

        def failed():
            result = attempt(arm.read)
            if isinstance(result, DeviceError) and not isinstance(result, StaleData):
                found.append(str(result))
            return bool(found)

        assert until(failed, 6)
        assert "nothing new for" in found[0]
        assert until(lambda: not isinstance(attempt(arm.read), DeviceError), 10)


@contextlib.contextmanager
def slowed(mock, fraction):
    """The speed slider down, as a person sets it at the pendant."""
    with Client(host_of(mock)) as client:
        slider, _ = client.inputs("speed_slider_mask", "speed_slider_fraction")
        client.start()
        client.write(slider, "Id", 1, fraction)
        try:
            yield
        finally:
            client.write(slider, "Id", 1, 1.0)


def rests_for_good(mock, arm):
    """Whether it comes to rest, and its states stay valid for longer than every time limit."""
    assert until(lambda: truly_at_rest(mock), 3)
    ends = CLOCK.now() + 300_000_000
    while CLOCK.now() < ends:
        result = attempt(arm.read)
        assert not isinstance(result, DeviceError) or isinstance(result, StaleData), result
    return truly_at_rest(mock)


def test_with_the_speed_slider_down_stops_take_their_time(mock):
    with connected(mock) as arm, slowed(mock, 0.1):
        arm.arm()
        for _ in range(2):
            # A hundredth of the deceleration: 13 mm/s take more than half a second.
            assert until(lambda: not isinstance(attempt(arm.command, up(0.13, within_s=2.5)), DeviceError))
            assert until(lambda: arm.read().tcp_twist.linear_m_s[2] > 0.01, 5)
            arm.stop()
            assert rests_for_good(mock, arm)
        arm.command(up(-0.03))


@pytest.mark.parametrize("ended", ["expiry", "stop"])
def test_a_stop_longer_than_the_watchdog_waits_leaves_the_program_running(mock, ended):
    with connected(mock, stop_acceleration_m_s2=0.2) as arm:
        arm.arm()
        for _ in range(2):
            # Half a second to brake, at ten hertz of watchdog.
            assert until(lambda: not isinstance(attempt(arm.command, up(0.1, within_s=0.3)), DeviceError))
            assert until(lambda: arm.read().tcp_twist.linear_m_s[2] > 0.08)
            if ended == "stop":
                arm.stop()
            assert rests_for_good(mock, arm)
        arm.command(up(-0.03))


FAULTS = {
    "drop": {"probability": 0.5},
    "delay": {"delay_ms": 60},
    "corrupt": {"probability": 0.05},
    "truncate": {"probability": 0.05},
    "split": {"delay_ms": 5},
    "duplicate": {},
    "freeze": {},
    "disconnect": {},
    "busy": {},
    "in-use": {},
    "delayed-ack": {},
}


@pytest.fixture(scope="class")
def lasting(mock):
    """One driver that goes through all faults, one after another; nothing is left of it at the end."""
    with connected(mock) as arm:
        arm.arm()
        yield arm


class TestUnderFaults:
    @pytest.mark.parametrize("kind", FAULTS)
    def test_no_call_hangs_and_it_comes_back(self, mock, lasting, kind):
        arm = lasting
        fault = {"for_s": 0.3, **FAULTS[kind]}
        if kind not in ("freeze", "disconnect"):
            fault["face"] = "rtde"
        mock.inject(kind, **fault)
        ends = CLOCK.now() + 450_000_000
        while CLOCK.now() < ends:
            attempt(arm.command, up(within_s=0.05))
            attempt(arm.read)
            CLOCK.sleep_until(CLOCK.now() + 8_000_000)
        attempt(arm.stop)
        attempt(arm.stop)
        assert until(lambda: truly_at_rest(mock), 5), "it runs on"
        assert until(lambda: not isinstance(attempt(arm.read), DeviceError), 12), "it does not come back"
        assert until(lambda: obeys(arm), 20), "it does not obey any more"


def test_stop_and_close_from_other_threads_while_it_moves(mock):
    with connected(mock) as arm:
        arm.arm()
        arm.command(up(within_s=20))
        assert until(lambda: arm.read().tcp_twist.linear_m_s[2] > 0.02)
        threads = [threading.Thread(target=arm.stop) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(CALL_S)
            assert not thread.is_alive()
        assert until(lambda: truly_at_rest(mock), 2)
        arm.close()
        arm.stop()
