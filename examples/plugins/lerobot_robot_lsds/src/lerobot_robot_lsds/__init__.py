"""The gripper of lsds as a robot of LeRobot, which imports this package by its name."""

from lerobot_robot_lsds.config_robot import LsdsRobotConfig
from lerobot_robot_lsds.robot import LsdsRobot

__all__ = ["LsdsRobot", "LsdsRobotConfig"]
