"""ur_rtde, as it comes from PyPI, against the mock: all its interfaces, two arms at once."""

from __future__ import annotations

import time

import pytest
from lsds_mocks.mock_process import MockProcess

from tests.wire.ur.arms import fresh_host

rtde_control = pytest.importorskip("rtde_control")
rtde_receive = pytest.importorskip("rtde_receive")
rtde_io = pytest.importorskip("rtde_io")
dashboard_client = pytest.importorskip("dashboard_client")

DOWN = [0.0, 0.0, 0.05, 0.0, 0.0, 0.0]


class Robot:
    def __init__(self, host):
        self.host = host
        self.receive = rtde_receive.RTDEReceiveInterface(host)
        self.control = rtde_control.RTDEControlInterface(host)
        self.home = self.receive.getActualQ()

    def close(self):
        self.control.stopScript()
        self.control.disconnect()
        self.receive.disconnect()


@pytest.fixture(scope="module")
def robot():
    with MockProcess("ur5e", {"host": fresh_host()}) as process:
        robot = Robot(process.addresses["rtde"].partition(":")[0])
        try:
            yield robot
        finally:
            robot.close()
        assert process.complaints == ""


@pytest.fixture(autouse=True)
def at_home(robot):
    yield
    assert robot.control.moveJ(robot.home, 3.0, 8.0)


def above(robot, dz=0.05):
    pose = robot.receive.getActualTCPPose()
    pose[2] += dz
    return pose


def wait_until(condition, timeout_s=5.0):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_moves_end_where_they_were_sent(robot):
    control, receive = robot.control, robot.receive
    q = [robot.home[0] + 0.2, *robot.home[1:]]
    assert control.moveJ(q, 1.05, 1.4)
    assert receive.getActualQ() == pytest.approx(q, abs=1e-9)
    pose = above(robot)
    assert control.moveL(pose, 0.5, 1.0)
    assert receive.getActualTCPPose() == pytest.approx(pose, abs=1e-9)
    pose = above(robot, -0.05)
    assert control.moveJ_IK(pose, 1.05, 1.4)
    assert receive.getActualTCPPose() == pytest.approx(pose, abs=1e-9)
    assert control.moveL_FK(robot.home, 0.5, 1.0)
    assert receive.getActualQ() == pytest.approx(robot.home, abs=1e-9)


def test_an_asynchronous_move_reports_its_progress_and_stops_on_command(robot):
    control, receive = robot.control, robot.receive
    before = control.getAsyncOperationProgressEx().operationId()
    assert control.moveJ([robot.home[0] + 1.0, *robot.home[1:]], 0.5, 1.0, True)
    wait_until(lambda: control.getAsyncOperationProgressEx().isAsyncOperationRunning())
    assert control.getAsyncOperationProgressEx().operationId() != before
    wait_until(lambda: receive.getActualQd()[0] > 0.3)
    control.stopJ(5.0)
    assert receive.getActualQd() == [0.0] * 6
    wait_until(lambda: not control.getAsyncOperationProgressEx().isAsyncOperationRunning())
    assert receive.getActualQ()[0] < robot.home[0] + 1.0
    assert control.moveL(above(robot, 0.1), 0.1, 0.5, True)
    wait_until(lambda: receive.getActualTCPSpeed()[2] > 0.05)
    control.stopL(5.0)
    assert receive.getActualTCPSpeed() == [0.0] * 6


def test_a_path_with_blends_is_followed(robot):
    a, b, c = above(robot, 0.05), above(robot, 0.05), above(robot, 0.05)
    b[0] += 0.05
    c[0] += 0.05
    c[1] -= 0.05
    path = [[*a, 0.5, 1.0, 0.0], [*b, 0.5, 1.0, 0.01], [*c, 0.5, 1.0, 0.0]]
    assert robot.control.moveL(path)
    # The client writes a path's numbers into the script with six digits.
    assert robot.receive.getActualTCPPose() == pytest.approx(c, abs=1e-5)
    mixed = rtde_control.Path()
    entry = rtde_control.PathEntry
    mixed.addEntry(entry(entry.MoveJ, entry.PositionJoints, [*robot.home, 1.0, 2.0, 0.0]))
    mixed.addEntry(entry(entry.MoveL, entry.PositionTcpPose, [*b, 0.5, 1.0, 0.0]))
    assert robot.control.movePath(mixed, False)
    assert robot.receive.getActualTCPPose() == pytest.approx(b, abs=1e-5)


@pytest.mark.parametrize("kind", ["speedL", "speedJ"])
def test_speeds_are_followed_and_stopped(robot, kind):
    control, receive = robot.control, robot.receive
    target = [0, 0, 0.03, 0, 0, 0] if kind == "speedL" else [0.05, 0, 0, 0, 0, 0]
    for _ in range(100):
        start = control.initPeriod()
        getattr(control, kind)(target, 0.5)
        control.waitPeriod(start)
    seen = receive.getActualTCPSpeed() if kind == "speedL" else receive.getActualQd()
    assert seen == pytest.approx(target, abs=1e-4)
    assert control.speedStop(10.0)
    assert receive.getActualQd() == [0.0] * 6


def test_servoing_follows_joints_and_poses(robot):
    control, receive = robot.control, robot.receive
    for step in range(150):
        start = control.initPeriod()
        q = [robot.home[0] + 0.0005 * step, *robot.home[1:]]
        control.servoJ(q, 0, 0, 0.002, 0.1, 300)
        control.waitPeriod(start)
    assert receive.getActualQ()[0] == pytest.approx(q[0], abs=0.06)
    assert receive.getActualQ()[0] > robot.home[0] + 0.01
    assert control.servoStop()
    pose = above(robot, 0.02)
    for _ in range(400):
        start = control.initPeriod()
        control.servoL(pose, 0, 0, 0.002, 0.05, 500)
        control.waitPeriod(start)
    assert receive.getActualTCPPose() == pytest.approx(pose, abs=1e-4)
    assert control.servoStop()


def test_jogging_moves_in_the_chosen_frame(robot):
    assert robot.control.jogStart([0.02, 0, 0, 0, 0, 0], rtde_control.RTDEControlInterface.FEATURE_BASE)
    wait_until(lambda: robot.receive.getActualTCPSpeed()[0] > 0.015)
    assert robot.control.jogStop()
    assert robot.control.jogStart([0, 0, 0.02, 0, 0, 0], rtde_control.RTDEControlInterface.FEATURE_TOOL)
    # The tool looks down: its z is the base's -z.
    wait_until(lambda: robot.receive.getActualTCPSpeed()[2] < -0.015)
    assert robot.control.jogStop()


def test_tool_payload_and_kinematics_answer(robot):
    control, receive = robot.control, robot.receive
    flange = receive.getActualTCPPose()
    assert control.setTcp([0, 0, 0.1, 0, 0, 0])
    assert control.getTCPOffset() == pytest.approx([0, 0, 0.1, 0, 0, 0])
    assert receive.getActualTCPPose()[2] == pytest.approx(flange[2] - 0.1, abs=2e-3)
    assert control.setTcp([0.0] * 6)
    assert control.setPayload(1.5, [0.0, 0.0, 0.05])
    wait_until(lambda: receive.getPayload() == 1.5)
    assert receive.getPayloadCog() == [0.0, 0.0, 0.05]
    assert control.getForwardKinematics() == pytest.approx(receive.getActualTCPPose())
    pose = above(robot, 0.05)
    q = control.getInverseKinematics(pose, robot.home)
    assert control.moveJ(q, 1.0, 2.0)
    assert receive.getActualTCPPose() == pytest.approx(pose, abs=1e-8)
    assert control.getInverseKinematicsHasSolution(pose)
    assert not control.getInverseKinematicsHasSolution([3.0, 0, 0, 0, 0, 0])
    assert control.isPoseWithinSafetyLimits(pose)
    assert not control.isPoseWithinSafetyLimits([3.0, 0, 0, 0, 0, 0])
    assert control.isJointsWithinSafetyLimits(robot.home)
    assert control.poseTrans(DOWN, DOWN) == pytest.approx([0, 0, 0.1, 0, 0, 0])
    assert control.getActualToolFlangePose() is not None
    assert control.isSteady()
    assert control.zeroFtSensor()
    # The client reads this answer before the controller has written it: the first ones are those of the call before.
    wait_until(lambda: control.getStepTime() == 0.002)


def test_a_users_own_script_runs_and_control_comes_back(robot):
    assert robot.control.sendCustomScriptFunction("own", '  textmsg("own")\n  write_output_float_register(20, 2.5)\n')
    wait_until(robot.control.isProgramRunning)


def test_terminals_switch_and_are_read_back(robot):
    io = rtde_io.RTDEIOInterface(robot.host)
    try:
        for index in (0, 7):
            io.setStandardDigitalOut(index, True)
            io.setConfigurableDigitalOut(index, True)
        io.setToolDigitalOut(1, True)
        io.setAnalogOutputVoltage(0, 0.25)
        wait_until(lambda: robot.receive.getActualDigitalOutputBits() == (0b10000001 | 0b10000001 << 8 | 1 << 17))
        wait_until(lambda: robot.receive.getStandardAnalogOutput0() == pytest.approx(2.5))
        io.setSpeedSlider(0.5)
        wait_until(lambda: robot.receive.getTargetSpeedFraction() == 0.5)
    finally:
        io.setSpeedSlider(1.0)
        wait_until(lambda: robot.receive.getTargetSpeedFraction() == 1.0)
        io.disconnect()


def test_the_watchdog_stops_the_program_of_a_client_that_falls_silent(robot):
    assert robot.control.setWatchdog(10.0)
    for _ in range(20):
        assert robot.control.kickWatchdog()
        time.sleep(0.02)
    assert robot.control.isProgramRunning()
    wait_until(lambda: not robot.control.isProgramRunning())
    robot.control.reuploadScript()
    wait_until(robot.control.isProgramRunning)


def test_a_protective_stop_is_seen_unlocked_and_recovered_from(robot):
    robot.control.triggerProtectiveStop()
    wait_until(robot.receive.isProtectiveStopped)
    assert not robot.control.moveJ(robot.home)
    board = dashboard_client.DashboardClient(robot.host)
    board.connect()
    with pytest.raises(RuntimeError, match="Cannot unlock protective stop until 5s"):
        board.unlockProtectiveStop()
    time.sleep(5.0)
    board.unlockProtectiveStop()
    wait_until(lambda: not robot.receive.isProtectiveStopped())
    assert board.robotmode() == "Robotmode: RUNNING"
    assert board.getSerialNumber() == "20235501234"
    board.disconnect()
    robot.control.reuploadScript()
    wait_until(robot.control.isProgramRunning)
    assert robot.control.moveJ(robot.home)


def test_a_second_controller_is_refused_because_its_registers_are_in_use(robot):
    with pytest.raises(RuntimeError):
        rtde_control.RTDEControlInterface(robot.host)


def test_two_arms_at_once_do_not_know_of_each_other(robot):
    with MockProcess("ur5e", {"host": fresh_host(), "model": "ur3e"}) as process:
        other = Robot(process.addresses["rtde"].partition(":")[0])
        try:
            assert other.receive.getActualTCPPose() != robot.receive.getActualTCPPose()
            assert other.control.moveJ([other.home[0] + 0.5, *other.home[1:]], 1.0, 2.0, True)
            assert robot.control.moveJ([robot.home[0] - 0.3, *robot.home[1:]], 1.0, 2.0)
            wait_until(lambda: other.receive.getActualQ()[0] == pytest.approx(other.home[0] + 0.5))
            assert robot.receive.getActualQ()[0] == pytest.approx(robot.home[0] - 0.3)
        finally:
            other.close()
