"""The robot in the simulated cell, without LeRobot and without hardware."""

from __future__ import annotations

import importlib.metadata
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lsds
import numpy as np
import pytest
from lsds.contracts import ArmCommand
from lsds.errors import ConfigError, DeviceFault, SafetyStop

from lerobot.cameras.configs import CameraConfig
from lerobot.robots.config import RobotConfig
from lerobot_robot_lsds import LsdsRobot, LsdsRobotConfig

FAST = ["cell.simulated.fidelity=winkler"]
STROKE_M = 0.05
GRIP = 0.0236 / STROKE_M * 100
"""The position that squeezes the simulated pipe by a little."""


def config(**given: Any) -> LsdsRobotConfig:
    return LsdsRobotConfig(**{"overrides": FAST, **given})


@pytest.fixture
def robot() -> Iterator[LsdsRobot]:
    robot = LsdsRobot(config())
    robot.connect()
    yield robot
    if robot.is_connected:
        robot.disconnect()


def run(robot: LsdsRobot, count: int, position: float | None = None) -> dict[str, Any]:
    """Return the last of some observations; an action comes before each."""
    for _ in range(count):
        if position is not None:
            robot.send_action({"gripper.pos": position})
        observation = robot.get_observation()
    return observation


def engine(robot: LsdsRobot) -> lsds.Engine:
    assert robot._running is not None
    return robot._running.engine


def lift(robot: LsdsRobot, count: int, position: float) -> dict[str, Any]:
    """Let the arm lift as another program would, while actions come."""
    arm, clock = engine(robot).rig.arm, engine(robot).rig.clock
    assert arm is not None
    for _ in range(count):
        arm.command(ArmCommand(lsds.Twist(linear_m_s=(0.0, 0.0, 0.03)), 0.5, clock.now() + 100_000_000))
        observation = run(robot, 1, position)
    return observation


def aperture_m(robot: LsdsRobot) -> float:
    cell = engine(robot).rig.cell
    assert cell is not None
    return cell.truth().aperture_m


# -- the interface --------------------------------------------------------------------------------------------


def test_lerobot_finds_distribution_config_and_class_by_their_names() -> None:
    assert importlib.metadata.distribution("lerobot_robot_lsds").metadata["Name"] == "lerobot_robot_lsds"
    assert RobotConfig.get_choice_class("lsds") is LsdsRobotConfig
    assert config().type == LsdsRobot.name == "lsds"
    assert LsdsRobotConfig.__name__.removesuffix("Config") == LsdsRobot.__name__
    assert LsdsRobotConfig.__module__.rpartition(".")[0] == "lerobot_robot_lsds"


def test_observations_have_the_features_that_are_known_before_connecting() -> None:
    robot = LsdsRobot(config())
    features = robot.observation_features
    assert robot.action_features == {"gripper.pos": float}
    assert robot.is_calibrated
    robot.connect()
    observation = robot.get_observation()
    robot.disconnect()
    assert list(observation) == list(features)
    for name, feature in features.items():
        if feature is float:
            assert math.isfinite(observation[name])
        else:
            assert observation[name].shape == feature == (240, 320, 3)
            assert observation[name].dtype == np.uint8


def test_images_may_be_left_out_and_each_finger_has_its_own(tmp_path: Path) -> None:
    assert "finger" not in LsdsRobot(config(images=False)).observation_features
    rig = tmp_path / "rig.toml"
    left = '[sensors.left]\nbackend = "mock-gelsight-mini"\n'
    right = '[sensors.right]\nbackend = "mock-gelsight-mini"\n[sensors.right.mock-gelsight-mini]\nfinger = "right"\n'
    rig.write_text(left + right)
    robot = LsdsRobot(config(rig=str(rig)))
    robot.connect()
    observation = run(robot, 3)
    robot.disconnect()
    assert list(observation) == list(robot.observation_features)
    assert not np.array_equal(observation["finger_left"], observation["finger_right"])


def test_it_is_connected_between_connect_and_disconnect() -> None:
    robot = LsdsRobot(config())
    calls: list[Callable[[], Any]] = [robot.get_observation, robot.disconnect, lambda: robot.send_action({})]
    for call in calls:
        with pytest.raises(ConnectionError, match=r"not connected; call connect\(\)"):
            call()
    for _ in range(2):
        robot.connect()
        assert robot.is_connected
        with pytest.raises(ConnectionError, match="already connected"):
            robot.connect()
        robot.disconnect()
        assert not robot.is_connected


@pytest.mark.parametrize(
    ("action", "words"),
    [
        ({}, r"the action has \[\]; give 'gripper.pos' alone"),
        ({"gripper.pos": 50.0, "wrist.pos": 1.0}, "wrist.pos"),
        ({"gripper.pos": math.nan}, r"gripper.pos is nan; give a number from 0 \(closed\)"),
    ],
)
def test_a_malformed_action_is_refused_and_changes_nothing(
    robot: LsdsRobot, action: dict[str, float], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        robot.send_action(action)
    assert run(robot, 5)["gripper.pos"] == pytest.approx(100.0)


def test_an_action_is_limited_to_the_stroke_and_returned(robot: LsdsRobot) -> None:
    assert robot.send_action({"gripper.pos": 130}) == {"gripper.pos": 100.0}
    assert robot.send_action({"gripper.pos": -1}) == {"gripper.pos": 0.0}


def test_a_rig_without_gripper_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"the robot needs a gripper \(choose a gripper backend\)"):
        LsdsRobot(config(overrides=[*FAST, "gripper.backend=none"])).connect()


# -- the grip -------------------------------------------------------------------------------------------------


def test_nothing_moves_before_the_first_action(robot: LsdsRobot) -> None:
    run(robot, 10)
    assert aperture_m(robot) == pytest.approx(STROKE_M, abs=1e-3)


def test_slip_closes_the_fingers_further_than_the_action(robot: LsdsRobot) -> None:
    held = run(robot, 30, GRIP)
    assert held["gripper.pos"] == pytest.approx(GRIP, abs=1.0)
    assert held["load.known"] == 1.0
    tightest = min(lift(robot, 1, GRIP)["gripper.pos"] for _ in range(20))
    assert tightest < GRIP - 1.0
    lifted = lift(robot, 10, GRIP)
    assert lifted["gripper.pos"] < GRIP - 0.5
    assert lifted["load.force"] > 0.5
    cell = engine(robot).rig.cell
    assert cell is not None
    assert cell.truth().object_height_m > 0.02
    assert not cell.truth().dropped


def test_noise_of_a_policy_neither_undoes_a_correction_nor_opens(robot: LsdsRobot) -> None:
    run(robot, 30, GRIP)
    lift(robot, 30, GRIP)
    for position in (GRIP + 0.8, GRIP - 0.8, GRIP + 0.8):
        assert lift(robot, 3, position)["gripper.pos"] < GRIP - 0.5
    cell = engine(robot).rig.cell
    assert cell is not None
    assert not cell.truth().dropped


def test_a_narrower_target_squeezes_and_a_wide_one_releases(robot: LsdsRobot) -> None:
    run(robot, 30, GRIP)
    assert run(robot, 20, GRIP - 4.0)["gripper.pos"] == pytest.approx(GRIP - 4.0, abs=1.0)
    # Wider than the last target, and still narrower than the object: the controller decides.
    assert run(robot, 20, GRIP - 1.0)["gripper.pos"] < GRIP - 2.0
    assert run(robot, 30, 90.0)["gripper.pos"] == pytest.approx(90.0, abs=1.0)
    assert run(robot, 30, GRIP)["load.known"] == 1.0


def test_the_probability_of_slip_rises_when_the_object_slips(robot: LsdsRobot) -> None:
    run(robot, 30, GRIP)
    arm, clock = engine(robot).rig.arm, engine(robot).rig.clock
    assert arm is not None
    seen = []
    for _ in range(30):
        arm.command(ArmCommand(lsds.Twist(linear_m_s=(0.0, 0.0, 0.03)), 0.5, clock.now() + 100_000_000))
        seen.append(robot.get_observation())
    assert max(one["slip.probability"] for one in seen) > 0.5
    assert max(one["slip.speed"] for one in seen) > 0.005


# -- what fails -----------------------------------------------------------------------------------------------


def test_an_error_is_raised_at_every_call_and_keeps_the_grip(robot: LsdsRobot, monkeypatch: pytest.MonkeyPatch) -> None:
    run(robot, 30, GRIP)
    gripped_m = aperture_m(robot)

    def lost() -> Any:
        raise DeviceFault("gel", "unplugged", remedy="plug it in")

    cell = engine(robot).rig.cell
    assert cell is not None
    monkeypatch.setattr(engine(robot).rig.sensor, "read", lost)
    for _ in range(2):
        with pytest.raises((DeviceFault, SafetyStop), match="unplugged"):
            run(robot, 30)
        with pytest.raises((DeviceFault, SafetyStop), match="unplugged"):
            robot.send_action({"gripper.pos": 100.0})
    robot.disconnect()
    assert cell.truth().aperture_m == pytest.approx(gripped_m, abs=1e-4)


def test_disconnect_keeps_the_grip(robot: LsdsRobot) -> None:
    run(robot, 30, GRIP)
    cell, gripped_m = engine(robot).rig.cell, aperture_m(robot)
    robot.disconnect()
    assert cell is not None
    assert cell.truth().aperture_m == pytest.approx(gripped_m, abs=1e-4)


# -- further cameras, real time -------------------------------------------------------------------------------


class Photo:
    """A camera of LeRobot."""

    def __init__(self, config: CameraConfig) -> None:
        self.is_connected = False
        self.broken = config.fps == 0

    def connect(self) -> None:
        if self.broken:
            raise ConnectionError("no such camera")
        self.is_connected = True

    def async_read(self) -> Any:
        return np.zeros((4, 6, 3), np.uint8)

    def disconnect(self) -> None:
        self.is_connected = False


@dataclass(kw_only=True)
class PhotoConfig(CameraConfig):
    camera_class = Photo


def test_further_cameras_come_and_go_with_the_robot() -> None:
    robot = LsdsRobot(config(cameras={"top": PhotoConfig(fps=30, width=6, height=4)}))
    assert robot.observation_features["top"] == (4, 6, 3)
    robot.connect()
    assert robot.get_observation()["top"].shape == (4, 6, 3)
    robot.disconnect()
    assert not robot.cameras["top"].is_connected


def test_a_camera_that_fails_closes_the_rig() -> None:
    robot = LsdsRobot(config(cameras={"top": PhotoConfig(fps=0, width=6, height=4)}))
    with pytest.raises(ConnectionError, match="no such camera"):
        robot.connect()
    assert not robot.is_connected


def test_in_real_time_the_engine_runs_between_the_calls() -> None:
    # The limits are wider than in a cell, because a test machine is busy.
    wide = ["safety.stale_after_s=2.0", "safety.frozen_after_s=2.0", "safety.watchdog_s=5.0"]
    robot = LsdsRobot(config(overrides=[*FAST, "clock=wall", "safety.command_lifetime_s=1.0", *wide]))
    robot.connect()
    try:
        robot.send_action({"gripper.pos": 70.0})
        until_s = time.monotonic() + 10.0
        while robot.get_observation()["gripper.pos"] > 71.0 and time.monotonic() < until_s:
            time.sleep(0.05)
        assert robot.get_observation()["gripper.pos"] == pytest.approx(70.0, abs=1.0)
    finally:
        robot.disconnect()
