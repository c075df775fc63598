"""The features of a LeRobot dataset: images, tactile values, states and commands.

Their form is that of LeRobotDataset v3.0 (https://huggingface.co/docs/lerobot/lerobot-dataset-v3, and `features` in
lerobot/datasets/utils.py of LeRobot 0.4).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from lsds.errors import DataError
from lsds.session.recording.export.content import parsed
from lsds.session.recording.messages import ARM, GRIPPER, IMAGE
from lsds.session.recording.reader import Recording

Feature = dict[str, Any]

STATE, ACTION = "observation.state", "action"
APERTURE_NAMES = ("aperture_m",)
POSE_NAMES = ("tcp_x_m", "tcp_y_m", "tcp_z_m", "tcp_qx", "tcp_qy", "tcp_qz", "tcp_qw")
TWIST_NAMES = ("tcp_vx_m_s", "tcp_vy_m_s", "tcp_vz_m_s", "tcp_wx_rad_s", "tcp_wy_rad_s", "tcp_wz_rad_s")
LOAD_NAMES = ("shear_x_n", "shear_y_n", "torque_nm")
FIELD, LOAD = "/finger/{}/field", "/finger/{}/load"
COUNTERS: dict[str, str] = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
"""Features that every dataset has, and their types; `timestamp` in s since the episode began."""


@dataclass(frozen=True, slots=True)
class FingerLayout:
    """One finger: size of its images (px), number of markers, and whether the recording has its load."""

    name: str
    height_px: int
    width_px: int
    markers: int
    load: bool


@dataclass(frozen=True, slots=True)
class Layout:
    """The streams of a recording that become features."""

    fingers: tuple[FingerLayout, ...]
    arm: bool

    def features(self) -> dict[str, Feature]:
        """Return the features by name."""
        found: dict[str, Feature] = {}
        for finger in self.fingers:
            shape = [finger.height_px, finger.width_px, 3]
            names = ["height", "width", "channels"]
            found[image_key(finger.name)] = {"dtype": "image", "shape": shape, "names": names}
        found[STATE] = _vector(APERTURE_NAMES + POSE_NAMES * self.arm)
        for finger in self.fingers:
            moved = [f"marker_{number}_{axis}_m" for number in range(finger.markers) for axis in "xy"]
            found[displacement_key(finger.name)] = _vector(moved)
            if finger.load:
                found[load_key(finger.name)] = _vector(LOAD_NAMES)
        found[ACTION] = _vector(APERTURE_NAMES + TWIST_NAMES * self.arm)
        counters = {name: {"dtype": kind, "shape": [1], "names": None} for name, kind in COUNTERS.items()}
        return found | counters


def survey(recording: Recording) -> tuple[Layout, int]:
    """Return the layout of a recording, and the number of its messages. Raises DataError if a stream is missing."""
    first: dict[str, Any] = {}
    messages = 0
    for raw in recording.messages():
        messages += 1
        first.setdefault(raw.topic, raw)
    names = [finger.name for finger in recording.header.fingers]
    needed = [GRIPPER, *(topic.format(name) for name in names for topic in (IMAGE, FIELD))]
    if missing := [topic for topic in needed if topic not in first]:
        raise DataError(
            f"{recording.path}: a LeRobot dataset needs {', '.join(missing)}, which the recording does not have "
            "(record a run with a gripper, or export to parquet)"
        )
    fingers = []
    for name in names:
        height, width = _size_px(first[IMAGE.format(name)], recording)
        markers = len(first[FIELD.format(name)].value["displacement_m"])
        fingers.append(FingerLayout(name, height, width, markers, LOAD.format(name) in first))
    return Layout(tuple(fingers), ARM in first), messages


def image_key(finger: str) -> str:
    """Return the name of the feature with the images of a finger."""
    return f"observation.images.{finger}"


def displacement_key(finger: str) -> str:
    """Return the name of the feature with the displacements of a finger's markers."""
    return f"observation.tactile.{finger}.displacement"


def load_key(finger: str) -> str:
    """Return the name of the feature with the load of a finger."""
    return f"observation.tactile.{finger}.load"


def _vector(names: tuple[str, ...] | list[str]) -> Feature:
    return {"dtype": "float32", "shape": [len(names)], "names": list(names)}


def _size_px(raw: Any, recording: Recording) -> tuple[int, int]:
    try:
        image = cv2.imdecode(np.frombuffer(parsed(raw).data, np.uint8), cv2.IMREAD_COLOR)
    except (ValueError, cv2.error):
        image = None
    if image is None:
        raise DataError(f"{recording.path}: the first image of {raw.topic} is damaged (lsds record cut leaves it out)")
    return image.shape[0], image.shape[1]
