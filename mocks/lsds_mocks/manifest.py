"""Backends that this package registers with lsds. Listing plugins must not import numpy or cv2."""

from __future__ import annotations

import pluggy

from lsds.contracts.backend import BackendSpec
from lsds_mocks.faults.catalogue import CATALOGUE

hookimpl = pluggy.HookimplMarker("lsds")


@hookimpl
def lsds_backends() -> list[BackendSpec]:
    """Return the simulated cell and the devices that live in it."""
    return [
        BackendSpec(
            "cell",
            "simulated",
            "lsds_mocks.cell.build:build_cell",
            "lsds_mocks.cell.options:CellOptions",
            summary="simulated cell: object on a table between two gel fingers, with friction, slip and lift",
            requires=("numba",),
            extra="sim",
            virtual_time=True,
        ),
        BackendSpec(
            "cell",
            "mujoco",
            "lsds_mocks.fingertip.mujoco_plant:build_mujoco_cell",
            "lsds_mocks.fingertip.mujoco_options:MujocoCellOptions",
            summary="the same mocks in a MuJoCo scene, yours or that of a pipe: MuJoCo moves pads and object",
            requires=("mujoco", "numba"),
            extra="mujoco",
            virtual_time=True,
        ),
        BackendSpec(
            "cell",
            "wire",
            "lsds_mocks.cell.processes:ProcessCell",
            "lsds_mocks.cell.processes:ProcessCellOptions",
            summary="the same cell in separate processes: real drivers reach its mocks over their wire protocols",
            requires=("numba",),
            extra="sim",
            over_wire=True,
        ),
        BackendSpec(
            "sensor",
            "mock-gelsight-mini",
            "lsds_mocks.devices.gelsight:MockGelSightMini",
            "lsds_mocks.devices.gelsight_options:GelSightOptions",
            summary="simulated GelSight Mini: 320x240 RGB with markers, 25 Hz, latency, noise",
            requires=("numba",),
            extra="sim",
            virtual_time=True,
            in_cell=True,
        ),
        BackendSpec(
            "gripper",
            "mock-hand-e",
            "lsds_mocks.devices.hand_e:MockHandE",
            "lsds_mocks.devices.hand_e_options:HandEOptions",
            summary="simulated Robotiq Hand-E: ticks, speed and force bytes, latency, object detection",
            requires=("numba",),
            extra="sim",
            virtual_time=True,
            in_cell=True,
        ),
        BackendSpec(
            "arm",
            "mock-ur5e",
            "lsds_mocks.devices.ur5e:MockUR5e",
            "lsds_mocks.devices.ur5e_options:UR5eOptions",
            summary="simulated UR5e: follows vertical Cartesian velocities",
            requires=("numba",),
            extra="sim",
            virtual_time=True,
            in_cell=True,
        ),
        *(
            BackendSpec(
                "fault",
                entry.name,
                f"lsds_mocks.faults.{entry.factory}",
                "lsds_mocks.faults.plan:FaultOptions",
                summary=entry.summary,
            )
            for entry in CATALOGUE
        ),
        BackendSpec(
            "wire_mock",
            "gelsight-mini",
            "lsds_mocks.wire.cameras.gelsight_mini:build",
            "lsds_mocks.wire.cameras.options:GelSightMiniOptions",
            summary="a GelSight Mini as MJPEG on HTTP, and through a named pipe",
            requires=("numba",),
            extra="sim",
        ),
        *(
            BackendSpec(
                "wire_mock",
                name,
                "lsds_mocks.wire.robotiq.server:RobotiqMock",
                f"lsds_mocks.wire.robotiq.options:{options}",
                summary=f"a Robotiq {title} on a pseudo-terminal, RTU over TCP and URCap strings",
            )
            for name, options, title in (
                ("hand-e", "HandEOptions", "Hand-E"),
                ("robotiq-2f-85", "TwoFinger85Options", "2F-85"),
                ("robotiq-2f-140", "TwoFinger140Options", "2F-140"),
            )
        ),
        BackendSpec(
            "wire_mock",
            "plant",
            "lsds_mocks.link.plant_server:PlantMock",
            "lsds_mocks.link.plant_options:PlantOptions",
            summary="physics of a cell, for wire mocks that connect to its socket (--cell)",
            requires=("numba",),
            extra="sim",
        ),
        BackendSpec(
            "wire_mock",
            "ur5e",
            "lsds_mocks.wire.ur.mock:MockUr",
            "lsds_mocks.wire.ur.options:UrOptions",
            summary="e-Series arm: dashboard, script ports, RTDE; runs URScript (--model for other sizes)",
        ),
        BackendSpec(
            "pose_source",
            "mock-truth-camera",
            "lsds_mocks.devices.truth_camera:MockTruthCamera",
            "lsds_mocks.devices.truth_camera_options:TruthCameraOptions",
            summary="simulated ground-truth camera: finds rendered ArUco markers on gripper and object, 60 Hz",
            requires=("numba",),
            extra="sim",
            virtual_time=True,
            in_cell=True,
        ),
        BackendSpec(
            "wire_mock",
            "truth-camera",
            "lsds_mocks.wire.cameras.truth_camera:TruthCamera",
            "lsds_mocks.wire.cameras.options:TruthCameraOptions",
            summary="ArUco markers on gripper and object at 60 Hz: MJPEG on HTTP, or a RealSense recording",
            requires=("numba",),
            extra="sim",
        ),
    ]
