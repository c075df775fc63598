"""Recordings of the simulated cell, and the answers of the imprint's detectors and estimators frame by frame."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from lsds_mocks.cell.build import build_cell
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.devices.gelsight import MockGelSightMini
from lsds_mocks.devices.gelsight_options import GelSightOptions
from lsds_mocks.devices.hand_e import MockHandE
from lsds_mocks.devices.hand_e_options import HandEOptions
from lsds_mocks.devices.ur5e import MockUR5e
from lsds_mocks.devices.ur5e_options import UR5eOptions

from lsds.clock import VirtualClock
from lsds.contracts import ArmCommand, BuildContext, GripperCommand, Twist
from lsds.runtime.engine import Engine
from lsds.session.track import engine_of

MS, FAR = 1_000_000, 10**15
LOOSE_M, FIRM_M = 0.0236, 0.0215
"""Apertures that grip the default pipe with about 80 % and about 230 % of the required force, m."""
GRIPS_S, LIFTS_S = 0.35, 1.0
LOADED_S = 0.25
"""Time from the start of the lift until the object has its full load and the arm's speed, s."""
SLIPS_M_S = 3e-3
"""Minimum speed of the object against the gel's base that is slip, m/s, as in measured labels."""


class Recording(NamedTuple):
    """Images (n, h, w, 3), their times (s), and the object's true speed against the gel's base (m/s)."""

    images: list[np.ndarray]
    t_s: np.ndarray
    speed_m_s: np.ndarray
    rate_hz: float


@lru_cache
def recorded(end_s: float, aperture_m: float | None, rate_hz: float = 25.0, pad: str = "7x9", wear: float = 0.0):
    """Return a recording in which the pipe is gripped with this aperture, None not at all, and then lifted."""
    context = BuildContext(VirtualClock(), 1)
    cell = build_cell(CellOptions(fidelity="pad", grid=1, history_s=end_s + 1), context)
    look = GelSightOptions(rate_hz=rate_hz, pad=pad, wear=wear, dim_start=False)
    sensor, gripper, arm = (
        MockGelSightMini(look, context),
        MockHandE(HandEOptions(), context),
        MockUR5e(UR5eOptions(), context),
    )
    for device in (sensor, gripper, arm):
        device.connect()
        device.arm()
    plan = [] if aperture_m is None else [(GRIPS_S, gripper, GripperCommand(aperture_m, 0.05, 60.0, FAR))]
    plan += [] if aperture_m is None else [(LIFTS_S, arm, ArmCommand(Twist((0.0, 0.0, 0.038)), 0.5, FAR))]
    frames = []
    for t_ms in np.arange(150, 1e3 * end_s, min(10.0, 400 / rate_hz)):
        context.clock.sleep_until(round(t_ms * MS))
        cell.advance(context.clock.now())
        while plan and t_ms >= 1e3 * plan[0][0]:
            _, device, command = plan.pop(0)
            device.command(command)
        frame = sensor.read()
        if not frames or frame.seq != frames[-1].seq:
            frames.append(frame)
    truth = cell.history()
    t_ns = np.array([moment.t_ns for moment in truth])
    speed = np.array([np.hypot(*moment.slip_velocity_m_s) for moment in truth])
    taken = np.array([frame.t_ns for frame in frames])
    # A frame shows the motion since the last one.
    since = [speed[(t_ns > a) & (t_ns <= b)] for a, b in pairwise(taken)]
    return Recording([f.image for f in frames], taken * 1e-9, np.array([0.0, *(s.mean() for s in since)]), rate_hz)


class Answers(NamedTuple):
    """Answers for each frame, and the engine at the end.

    `slip` (n,) is 1, 0, or NaN if the detector abstained or the frame was refused; `abstains` (n,) is whether the
    estimator abstained.
    """

    slip: np.ndarray
    abstains: np.ndarray
    engine: Engine


def watched(folder: Path, images: list[np.ndarray], backend: str, rate_hz: float = 25.0) -> Answers:
    """Write images as a recording and return the answers of detector and estimator to it, as `lsds track` does."""
    folder.mkdir()
    for number, image in enumerate(images):
        cv2.imwrite(str(folder / f"{number:04}.png"), image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 1])
    chosen = [f"detector.backend={backend}", f"estimator.backend={backend}", f"sensor.video.rate_hz={rate_hz}"]
    engine = engine_of(folder, overrides=chosen)
    slip, abstains = np.full(len(images), np.nan), np.ones(len(images), bool)
    for cycle in engine:
        slip[cycle.frame.seq] = np.nan if cycle.detection.slip is None else cycle.detection.slip
        abstains[cycle.frame.seq] = cycle.estimate.abstained
        assert cycle.estimate.abstained or np.isfinite([cycle.estimate.speed_m_s, *cycle.estimate.velocity_m_s]).all()
    return Answers(slip, abstains, engine)
