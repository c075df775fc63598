"""An object that is pressed against a fingertip and then slides or turns, as seen by a detector and an estimator."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lsds.config import load_config
from lsds.contracts import Frame
from lsds.registry import PluginHost
from lsds.runtime.rig import Rig
from lsds.tactile.perception import Perception

if TYPE_CHECKING:
    from lsds_mocks.fingertip.fingertip import FingertipTruth

    from lsds.contracts import Detection, SlipEstimate

REFERENCE_FRAMES = 2
"""Number of frames of the untouched gel."""
PRESSED_FRAMES = 4
"""Number of frames in which the object rests, pressed against the gel."""
SHEARED_FRAMES = 5
"""Number of frames in which the object shears the gel and sticks, before it slides."""
SHEAR_PER_FRAME_M = 0.04e-3
"""Way of the object in each of them, m: 1 mm/s at 25 Hz."""
NORMAL_N = 6.0
"""Normal force, N."""
STEP_S = 5e-3
"""Maximum time of a step of the gel, s: forces do not matter here, only the surface's place."""
SLIPPING_FRAMES = 8
"""Number of frames in gross slip that are judged."""
MOST_FRAMES = 60
"""Maximum number of frames of motion before gross slip begins."""


class Judged(NamedTuple):
    """Detection and estimate of a frame, and the truth at its time."""

    detection: Detection
    estimate: SlipEstimate
    truth: FingertipTruth

    @property
    def slips(self) -> bool:
        """Whether the object is in gross slip."""
        return bool(any(self.truth.slip_velocity_m_s) or self.truth.slip_angular_rad_s)


def judged_frames(
    cell: dict[str, Any],
    *,
    detector: str,
    estimator: str,
    velocity_m_s: float = 0.0,
    turn_rad_s: float = 0.0,
    interval_s: float = 0.04,
    seed: int = 0,
) -> list[Judged]:
    """Press an object described by keys of `[cell.simulated]`, shear the gel, and move it down or turn it at a rate.

    Returns the frames of motion, the last `SLIPPING_FRAMES` of them in gross slip unless the object sticks for
    `MOST_FRAMES`.
    """
    from lsds_mocks.cell.options import CellOptions
    from lsds_mocks.fingertip.fingertip import SimulatedFingertip
    from lsds_mocks.fingertip.pose import Pose

    options = CellOptions(**cell)
    tip = SimulatedFingertip(options, seed=seed)
    host = PluginHost()
    rig = Rig(load_config(None, (f"detector.backend={detector}", f"estimator.backend={estimator}"), host=host), host)
    perception = Perception(rig.tracker, rig.sensor.spec, rig.config.tactile)
    pad, half_m = Pose.of((0.0, 0.0, 0.0)), options.diameter_mm * 0.5e-3
    interval_ns = round(interval_s * 1e9)
    t_ns = seq = 0

    depth_m = 0.0

    def pose(time_s: float) -> Pose:
        angle = turn_rad_s * time_s
        cosine, sine = math.cos(angle), math.sin(angle)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        return Pose.of((0.0, sheared_m + velocity_m_s * time_s, half_m - depth_m), turn)

    def seen() -> Frame:
        nonlocal t_ns, seq
        t_ns, seq = t_ns + interval_ns, seq + 1
        return Frame(tip.image(), t_ns, seq)

    perception.start([seen() for _ in range(REFERENCE_FRAMES)])
    depth_m, sheared_m = 1e-4, 0.0
    touching = pose(0.0)
    for _ in range(PRESSED_FRAMES):
        tip.step(pad, touching, interval_s, normal_n=NORMAL_N)
        _judge(rig, perception, seen())
    depth_m = tip.truth().indentation_m
    parts = math.ceil(interval_s / STEP_S)
    found: list[Judged] = []
    slipping = 0
    for _ in range(SHEARED_FRAMES):
        sheared_m += SHEAR_PER_FRAME_M
        tip.step(pad, pose(0.0), interval_s)
        found.append(Judged(*_judge(rig, perception, seen()), tip.truth()))
    for frame in range(MOST_FRAMES):
        for part in range(parts):
            tip.step(pad, pose(interval_s * (frame + (part + 1) / parts)), interval_s / parts)
        found.append(Judged(*_judge(rig, perception, seen()), tip.truth()))
        slipping += found[-1].slips
        if slipping == SLIPPING_FRAMES:
            break
    return found


def _judge(rig: Rig, perception: Perception, frame: Frame) -> tuple[Detection, SlipEstimate]:
    observation, _ = perception.observe(frame)
    return rig.detector.update(observation), rig.estimator.update(observation)
