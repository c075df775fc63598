"""Small recordings of a gel, painted as folders of images, in which it is known what slips, and their labels."""

from __future__ import annotations

import math
import os
import shutil
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from lsds_research.slips.labels import NAME, Interval, Labels, State, write_labels
from tactile.imprinted import Motion, bumps, painted

COUNT, FIRST, LAST = 30, 10, 21
"""Frames of a recording; first and last one that slip."""
TRAVEL_PX, TURN_DEG = 36.0, 24.0
SLIDE, STICK, TURN = "mug__slide", "mug__stick", "mug__turn"
_STILL = Motion()


def _slipped() -> np.ndarray:
    """Share of the slip (n,) that is over, frame by frame."""
    return np.clip((np.arange(COUNT) - FIRST + 1) / (LAST - FIRST + 1), 0, 1)


def paint(folder: Path) -> Path:
    """Write three recordings and their labels: one slides, one turns, and one is carried to and fro by the gel."""
    over, depth = _slipped(), bumps()

    @lru_cache
    def png(body: Motion, gel: Motion, noise: int) -> np.ndarray:
        image = painted(depth, body, gel, seq=noise).image
        return cv2.imencode(".png", image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]

    # The load rises, falls, rises and falls again, five frames each.
    load = 1.5 * np.interp(np.arange(COUNT), [9, 14, 19, 24, 29], [0, 5, 0, 5, 0])
    scenes = {
        SLIDE: [(Motion(TRAVEL_PX * (share - 0.5)), _STILL) for share in over],
        STICK: [(Motion(shift, -shift / 2), Motion(shift, -shift / 2)) for shift in load],
        TURN: [(Motion(turn=math.radians(TURN_DEG * (share - 0.5))), _STILL) for share in over],
    }
    for name, motions in scenes.items():
        (folder / name).mkdir(parents=True)
        for number, (body, gel) in enumerate(motions):
            # The noise of a frame is another than that of those before it.
            (folder / name / f"{number:03}.png").write_bytes(png(body, gel, number % 3).tobytes())
    write_labels(folder / NAME, truth())
    return folder


def truth() -> Labels:
    """What happens in them."""

    def slips(x: float, y: float, turn: float) -> list[Interval]:
        return [
            Interval(0, FIRST - 1, State.STICK),
            Interval(FIRST, LAST, State.SLIP, x, y, turn),
            Interval(LAST + 1, COUNT - 1, State.STICK),
        ]

    return {
        SLIDE: slips(TRAVEL_PX, 0.0, math.nan),
        STICK: [Interval(0, COUNT - 1, State.STICK)],
        TURN: slips(math.nan, math.nan, TURN_DEG),
    }


def copied(folder: Path, target: Path, objects: tuple[str, ...] = ("mug",)) -> Path:
    """Make a folder of the same recordings, of several objects that look alike; its files may be removed or replaced,
    and must not be written to."""
    labels: Labels = {}
    for thing in objects:
        for name, intervals in truth().items():
            alike = name.replace("mug", thing)
            labels[alike] = intervals
            shutil.copytree(folder / name, target / alike, copy_function=os.link)
    write_labels(target / NAME, labels)
    return target
