"""A clip run in the simulated cell and filmed by the mock GelSight Mini, on the virtual clock."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import cv2
from lsds_mocks.cell.build import build_cell
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.devices.gelsight import MockGelSightMini
from lsds_mocks.devices.gelsight_options import GelSightOptions

from lsds.clock import VirtualClock, seconds
from lsds.contracts import BuildContext
from lsds.errors import DataError, StaleData

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from lsds_mocks.cell.cell import SimulatedCell
    from lsds_mocks.plant.plant import Plant
    from numpy.typing import NDArray

    from lsds_research.studies.realism.clips import Clip

TICK_NS = 10_000_000
"""How often the hand is given a new velocity, and the camera is looked at."""
HAND_M_S2 = 20.0
"""Fast enough to follow any shaking that is drawn."""
LEAD_S = 2.0
"""From the cell's start to the first frame: time to grip in clips that begin with the object held."""
RECORDED_HZ = 25.0
"""The rate stated in the header of the recordings, independent of the camera's real rate."""


def film(clip: Clip, seed: int) -> list[NDArray[np.uint8]]:
    """Return the clip's frames (240, 320, 3) uint8 RGB. Same clip and seed: same frames, bit by bit."""
    context = BuildContext(VirtualClock(), seed * 100_003 + clip.number)
    cell = build_cell(CellOptions(**clip.cell), context)
    sensor = MockGelSightMini(GelSightOptions(**clip.sensor, first_frame_ms=LEAD_S * 1e3), context)
    sensor.connect()
    images: list[NDArray[np.uint8]] = []
    last, gripped, held, empty, released = -1, False, False, False, False
    _move_fingers(cell, context.clock.now(), clip.ajar_m, 0.1, clip.force_n)
    while len(images) < clip.frames:
        now = context.clock.now()
        t_s = seconds(now) - LEAD_S
        if not gripped and t_s >= clip.grip_s:
            gripped = True
            _move_fingers(cell, now, 0.0, clip.closing_m_s, clip.force_n)
        if not released and t_s >= clip.release_s:
            released = True
            _move_fingers(cell, now, clip.ajar_m, clip.closing_m_s, clip.force_n)
        if gripped and not released and cell.plant.fingers.stalled:
            # Held where they stalled: fingers that went on closing as the object slid out would sink into it.
            _move_fingers(cell, now, cell.plant.fingers.aperture_m, clip.closing_m_s, clip.force_n)
        empty = empty or (held and not released and cell.plant.normal_n == 0)
        held = cell.plant.normal_n > 0
        if empty and not released:
            # Stop shaking after the object is lost, and do not press the closed fingers on it.
            released = True
            _move_fingers(cell, now, clip.ajar_m, clip.closing_m_s, clip.force_n)
        _move_hand(cell, now, 0.0 if empty else clip.hand_m_s(t_s))
        context.clock.sleep_until(now + TICK_NS)
        try:
            frame = sensor.read()
        except StaleData:
            continue
        if frame.seq > last:
            last = frame.seq
            images.append(frame.image)
    sensor.close()
    return images


def write(frames: Sequence[NDArray[np.uint8]], path: Path, codec: Literal["XVID", "FFV1"]) -> None:
    """Write a clip as the recordings were written. Raises DataError where the codec is missing or the disk full."""
    height, width = frames[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), RECORDED_HZ, (width, height))
    if not writer.isOpened():
        raise DataError(f"{path}: the simulated clip cannot be written as {codec} (room on the disk? OpenCV's FFmpeg?)")
    for frame in frames:
        writer.write(cv2.cvtColor(frame, cv2.COLOR_RGB2BGR))
    writer.release()


def _move_fingers(cell: SimulatedCell, t_ns: int, aperture_m: float, speed_m_s: float, limit_n: float) -> None:
    """Go to an aperture; fingers that meet the object on the way stall at `limit_n`."""

    def action(plant: Plant) -> None:
        plant.fingers.target_m, plant.fingers.speed_m_s, plant.fingers.limit_n = aperture_m, speed_m_s, limit_n

    cell.post(t_ns, "fingers", action)


def _move_hand(cell: SimulatedCell, t_ns: int, velocity_m_s: float) -> None:
    def action(plant: Plant) -> None:
        plant.arm.target_m_s, plant.arm.limit_m_s2 = velocity_m_s, HAND_M_S2

    cell.post(t_ns, "hand", action)
