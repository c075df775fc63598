"""The plugin in an installed LeRobot: the same names, signatures and discovery as in the stand-in."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
from lerobot.robots.config import RobotConfig
from lerobot.robots.robot import Robot
from lerobot.robots.utils import make_robot_from_config
from lerobot.utils import import_utils

discover = getattr(import_utils, "register_third_party_plugins", None) or import_utils.register_third_party_devices
discover()
config = RobotConfig.get_choice_class("lsds")(overrides=["cell.simulated.fidelity=winkler"])
robot = make_robot_from_config(config)
assert isinstance(robot, Robot)
robot.connect()
assert robot.send_action({"gripper.pos": 80.0}) == {"gripper.pos": 80.0}
for _ in range(30):
    observation = robot.get_observation()
assert set(observation) == set(robot.observation_features)
assert abs(observation["gripper.pos"] - 80.0) < 1.0
robot.disconnect()
print("found")
"""


def _run(program: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a program in a process that does not have the stand-in on its path."""
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=cwd)


def test_importing_the_plugin_loads_neither_torch_nor_pymodbus(tmp_path: Path) -> None:
    standin = Path(__file__).parent / "standin"
    program = f"import sys; sys.path.insert(0, {str(standin)!r}); import lerobot_robot_lsds; print(sorted(sys.modules))"
    done = _run(program, tmp_path)
    assert done.returncode == 0, done.stderr
    assert "'torch'" not in done.stdout
    assert "'pymodbus'" not in done.stdout


@pytest.mark.slow
def test_the_installed_lerobot_finds_and_reads_it(tmp_path: Path) -> None:
    if _run("import lerobot.robots.robot", tmp_path).returncode:
        pytest.skip("LeRobot is not installed: pip install 'lerobot>=0.4'")
    done = _run(PROGRAM, tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("found\n")
