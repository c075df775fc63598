"""The tactile fingertips of lsds as cameras of LeRobot, which imports this package by its name."""

from lerobot_camera_lsds.camera import LsdsCamera
from lerobot_camera_lsds.config_camera import LsdsCameraConfig

__all__ = ["LsdsCamera", "LsdsCameraConfig"]
