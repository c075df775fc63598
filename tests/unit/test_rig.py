from __future__ import annotations

import time

import pytest
from fake_cell import FakeArm, FakeCell, FakeGripper, FakeSensor

from lsds.clock import VirtualClock, WallClock
from lsds.config import check_config
from lsds.contracts import Lifecycle
from lsds.errors import BringUpError, ConfigError, ConnectFailed, ContractMismatch, PluginNotFound
from lsds.runtime.rig import Rig


@pytest.fixture
def build(host, fake_rig):
    def make(**changes):
        return Rig(check_config({**fake_rig, **changes}, "test", host), host)

    return make


def failing(name, call):
    return {"backend": name, name: {"fail": call}}


def calls(rig):
    return rig.context.shared("calls", list)


def test_everything_is_built_and_nothing_is_touched(build):
    rig = build()
    assert isinstance(rig.sensor, FakeSensor)
    assert isinstance(rig.gripper, FakeGripper)
    assert isinstance(rig.arm, FakeArm)
    assert isinstance(rig.cell, FakeCell)
    assert rig.pose_source is None
    assert isinstance(rig.clock, VirtualClock)
    assert rig.virtual
    assert calls(rig) == []


def test_a_rig_may_do_without(build):
    none = {"backend": "none"}
    rig = build(gripper=none, arm=none, cell=none)
    assert rig.gripper is rig.arm is rig.cell is None
    assert rig.devices == (rig.sensor,)


def test_up_and_down_in_order(build):
    with build(pose_source={"backend": "fake-poses"}) as rig:
        rig.arm_devices()
        assert all(device.lifecycle is Lifecycle.ARMED for device in rig.devices)
    names = ["fake-sensor", "fake-gripper", "fake-arm", "fake-poses"]
    assert calls(rig) == [
        *[f"{name}.connect" for name in names],
        *[f"{name}.arm" for name in names],
        *[f"{name}.stop" for name in names],
        *[f"{name}.close" for name in reversed(names)],
    ]
    rig.close()
    assert calls(rig).count("fake-arm.close") == 1


def test_disarm(build):
    with build() as rig:
        rig.arm_devices()
        rig.disarm()
        assert all(device.lifecycle is Lifecycle.CONNECTED for device in rig.devices)


@pytest.mark.parametrize("step", ["connect", "arm"])
def test_a_failed_bring_up_reports_all_devices_and_closes_them(build, step):
    rig = build(gripper=failing("fake-gripper", step))
    if step == "arm":
        rig.connect()
    with pytest.raises(BringUpError) as caught:
        rig.connect() if step == "connect" else rig.arm_devices()
    lines = str(caught.value).splitlines()
    assert lines == [
        f"the rig did not come up: 1 of 3 devices failed to {step}, all are closed again",
        "├─ sensor   fake-sensor   ok",
        f"├─ gripper  fake-gripper  failed: ConnectFailed: {step} did not work [code 7]",
        "│     to do: switch it on",
        "└─ arm      fake-arm      ok",
    ]
    assert isinstance(caught.value.__cause__, ConnectFailed)
    assert all(device.lifecycle is Lifecycle.CLOSED for device in rig.devices)


def test_all_failures_are_in_the_tree_with_trouble_while_closing(build, monkeypatch):
    def close(self):
        with self.guard.closing():
            raise OSError("stuck")

    monkeypatch.setattr(FakeSensor, "close", close)
    with pytest.raises(BringUpError) as caught:
        build(sensor=failing("fake-sensor", "connect"), arm=failing("fake-arm", "connect")).connect()
    message = str(caught.value)
    assert "2 of 3 devices failed" in message
    assert message.count("to do:") == 2
    assert "closing: PluginError: sensor 'fake-sensor' raised OSError at close(): stuck" in message


@pytest.mark.parametrize("call", ["connect", "stop", "close"])
def test_an_interrupt_in_the_middle_leaves_nothing_open(build, call):
    rig = build(gripper=failing("fake-gripper", f"interrupt {call}"))
    with pytest.raises(KeyboardInterrupt), rig:
        pass
    assert all(device.lifecycle is Lifecycle.CLOSED for device in rig.devices)
    assert "fake-arm.stop" in calls(rig)


def test_closing_goes_on_past_failures_and_reports_them_together(build):
    rig = build(gripper=failing("fake-gripper", "close"), arm=failing("fake-arm", "close"))
    rig.connect()
    with pytest.raises(ExceptionGroup) as caught:
        rig.close()
    assert [error.device for error in caught.value.exceptions] == ["fake-arm", "fake-gripper"]
    assert caught.value.exceptions[0].__notes__ == ["while closing the rig: arm fake-arm"]
    assert calls(rig)[-1] == "fake-sensor.close"


def test_the_first_error_wins_when_closing_fails_too(build):
    with pytest.raises(ValueError, match="first") as caught, build(arm=failing("fake-arm", "close")):
        raise ValueError("first")
    assert any("while closing" in note for note in caught.value.__notes__)


@pytest.mark.parametrize("clock", ["virtual", "wall"])
def test_stop_reaches_every_device_and_never_raises(build, clock):
    rig = build(gripper=failing("fake-gripper", "stop"), clock=clock)
    rig.connect()
    (problem,) = rig.stop()
    assert "gripper fake-gripper: stop() raised ConnectFailed" in problem
    assert {"fake-sensor.stop", "fake-gripper.stop", "fake-arm.stop"} <= set(calls(rig))
    rig.close()


def test_a_device_that_hangs_in_stop_keeps_no_other_moving(build, monkeypatch):
    monkeypatch.setattr("lsds.runtime.rig.CELL_STOP_S", 0.1)
    rig = build(clock="wall")
    rig.connect()
    monkeypatch.setattr(FakeSensor, "stop", lambda self: time.sleep(1.0))
    before = time.monotonic()
    problems = rig.stop()
    assert time.monotonic() - before < 0.8
    assert problems == ("sensor fake-sensor: stop() did not return within 0.1 s",)
    assert "fake-arm.stop" in calls(rig)
    monkeypatch.undo()
    rig.close()


def test_the_clock_follows_the_devices(build):
    real = {"backend": "real-sensor"}
    assert isinstance(build(sensor=real).clock, WallClock)
    assert isinstance(build(clock="wall").clock, WallClock)
    with pytest.raises(ConfigError, match="virtual time needs simulated devices only; real: real-sensor"):
        build(sensor=real, clock="virtual")


def test_a_moving_device_outside_the_cell_of_a_simulated_sensor_is_rejected(build):
    outside = "gripper 'real-gripper' is not part of the simulated cell that sensor 'fake-sensor' is in"
    with pytest.raises(ConfigError, match=outside + r" \(choose 'fake-gripper'") as refused:
        build(gripper={"backend": "real-gripper"})
    assert [issue.path for issue in refused.value.issues] == ["gripper.backend"]
    assert "lsds.contracts.plant.join" in str(refused.value)


@pytest.mark.parametrize("kind", ["pose_source", "gripper"])
def test_a_missing_or_passive_device_may_be_outside_the_cell(build, kind):
    assert build(**{kind: {"backend": "none"}}).sensor is not None
    assert build(sensor={"backend": "real-sensor"}, gripper={"backend": "real-gripper"}).gripper is not None


def test_a_real_cell_has_no_truth(build):
    none = {"backend": "none"}
    real = {"sensor": {"backend": "real-sensor"}, "gripper": {"backend": "real-gripper"}}
    rig = build(**real, arm=none)
    assert rig.cell is None
    assert "cell" not in rig.backends
    assert build(**real).cell is not None, "the arm is simulated, so there is a plant"


def test_seed_and_clock_reach_the_context(build):
    rig = build(seed=7)
    assert rig.context.seed == 7
    assert rig.context.clock is rig.clock


def test_an_error_of_a_backend_is_raised_unchanged(build, host, fake_rig):
    config = check_config(fake_rig, "test", host)
    with pytest.raises(ContractMismatch, match="incomplete"):
        build(gripper={"backend": "incomplete"})
    host.block(["fakes"])
    with pytest.raises(PluginNotFound):
        Rig(config, host)
