"""The plugin manifest of the drivers. Listing plugins must import neither cv2 nor a vendor's library."""

from __future__ import annotations

from lsds.contracts import BackendSpec
from lsds.registry import hookimpl


@hookimpl
def lsds_backends() -> list[BackendSpec]:
    """Return the drivers of real hardware."""
    return [
        BackendSpec(
            "gripper",
            "hand-e",
            "lsds_drivers.robotiq.backends:hand_e",
            "lsds_drivers.robotiq.options:HandEOptions",
            summary="Robotiq Hand-E on Modbus RTU: serial port, or tcp://host:port",
            requires=("pymodbus", "serial"),
            extra="robotiq",
        ),
        BackendSpec(
            "gripper",
            "robotiq-2f",
            "lsds_drivers.robotiq.backends:two_finger",
            "lsds_drivers.robotiq.options:TwoFingerOptions",
            summary="Robotiq 2F-85 or 2F-140 on Modbus RTU: serial port, or tcp://host:port",
            requires=("pymodbus", "serial"),
            extra="robotiq",
        ),
        BackendSpec(
            "gripper",
            "hand-e-urcap",
            "lsds_drivers.robotiq.backends:hand_e_urcap",
            "lsds_drivers.robotiq.options:UrcapOptions",
            summary="Robotiq Hand-E behind the URCap of a UR controller",
        ),
        BackendSpec(
            "sensor",
            "gelsight-mini",
            "lsds_drivers.gelsight.mini:build",
            "lsds_drivers.gelsight.mini:GelSightMiniOptions",
            summary="GelSight Mini on USB, as a network stream or through a pipe",
        ),
        BackendSpec(
            "sensor",
            "uvc-tactile",
            "lsds_drivers.cameras.uvc_tactile:build",
            "lsds_drivers.cameras.uvc_tactile:UvcTactileOptions",
            summary="any camera-based fingertip (DIGIT and others), described by its options",
        ),
        BackendSpec(
            "pose_source",
            "aruco",
            "lsds_drivers.aruco.source:ArucoPoseSource",
            "lsds_drivers.aruco.options:ArucoOptions",
            summary="poses of bodies with printed ArUco or ChArUco markers, by any camera or a RealSense",
        ),
        BackendSpec(
            "arm",
            "ur5e",
            "lsds_drivers.ur.arm:UrArm",
            "lsds_drivers.ur.options:UrOptions",
            summary="Universal Robots e-Series over RTDE (model = other sizes): Cartesian velocity commands",
            requires=("rtde_control", "rtde_receive", "dashboard_client"),
            extra="ur",
        ),
    ]
