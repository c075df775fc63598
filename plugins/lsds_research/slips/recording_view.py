"""A recording prepared for labelling: images, reliefs in coordinates fixed to the gel, and motion of the gel."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np
from lsds_plugins.replay.reader import open_reader

from lsds.calibration.watched import fastest
from lsds.contracts import Frame
from lsds.errors import DataError, LsdsError, naming
from lsds.tactile.imprint.motion import carried_gel, moved_dots
from lsds.tactile.imprint.relief import ReliefMaker
from lsds.tactile.working_image import WorkingImage
from lsds_research.recording_engine import recording_engine
from lsds_research.slips.labels import name_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import DeformationField
    from lsds.tactile.imprint.carrying import CarriedGel

    Floats = NDArray[np.float64]
    Plane = NDArray[np.float32]

SHOWN_MOTION_PX = 0.35
"""A frame is shown if the fastest tenth of the markers has moved by more than this (px)."""
CHANGED = 2.0
"""A frame is also shown if its change of relief exceeds the median by this factor."""
_FRAMES_BESIDE = 3
"""Number of frames that are shown before and after a range."""
_FRAMES_APART = 6
"""Maximum distance of two frames in one range, frames."""
_ARM_PX = 24.0
"""Distance from a position to the four points whose motion gives the gel's turn there, px of the image; chosen."""


class GelStep(NamedTuple):
    """Rigid motion of the gel at a place since the frame before: px of the image, rad clockwise; NaN if unknown."""

    x: float
    y: float
    turn: float


UNKNOWN = GelStep(math.nan, math.nan, math.nan)


class RecordingView:
    """All frames of a recording.

    `images` (n, h, w, 3) RGB and `relief` (n, h', w'), zero on dots and border, at 1 / `scale` of the image. `gel` is
    the motion of the gel since the last frame, None for too few markers; `dots` positions and motions (k, 2) of the
    markers, px; `moved_px` (n,) the motion of the fastest tenth of them.
    """

    def __init__(self, path: Path, tick: Callable[[int, int], object] | None = None) -> None:
        """Read a recording. Raises DataError if it cannot be read or shows no markers at the start."""
        self.name = name_of(path.absolute())
        reader = open_reader(str(path))
        images = [picture.image for picture in reader.images()]
        if images:
            # Use the size in which the gel is tracked, so that its motion fits the images.
            working = WorkingImage(Frame(images[0], 0, 0))
            images = [working.resized(image) for image in images]
        self.images = np.array(images)
        count = len(self.images)
        if count < 2:
            raise DataError(f"{path}: {count} frames, but no motion could be tracked")
        maker = ReliefMaker()
        found = [maker.relief(Frame(image, 0, number)) for number, image in enumerate(self.images)]
        self.scale = found[0].scale
        self.relief = np.array([each.curvature * each.weight for each in found])
        self.gel: list[CarriedGel | None] = [None] * count
        self.dots: list[tuple[Floats, Floats]] = [(np.zeros((0, 2)), np.zeros((0, 2)))] * count
        self._follow(path, tick)
        self.moved_px = np.array([fastest(moved) for _, moved in self.dots])

    def __len__(self) -> int:
        return len(self.images)

    def _follow(self, path: Path, tick: Callable[[int, int], object] | None) -> None:
        try:
            engine = recording_engine(path)
            last: DeformationField | None = None
            for cycle in engine:
                field, metres = cycle.observation.field, engine.perception.metres_per_px
                if last is not None and cycle.frame.seq == last.seq + 1:
                    self.gel[cycle.frame.seq] = carried_gel(last, field, metres)
                    self.dots[cycle.frame.seq] = moved_dots(last, field, metres)
                last = field
                if tick is not None:
                    tick(cycle.frame.seq + 1, len(self))
        except LsdsError as error:
            raise DataError(naming(path, error)) from error

    def centre(self, first: int, last: int) -> tuple[float, float]:
        """Return the centre (x, y) of the relief of frames `first` to `last`, in relief px."""
        mean = cv2.GaussianBlur(np.abs(self.relief[first : last + 1]).mean(axis=0), (0, 0), 3.0)
        weight = np.maximum(mean - np.quantile(mean, 0.6), 0.0) ** 2
        total = float(weight.sum()) or 1.0
        row, column = np.mgrid[: weight.shape[0], : weight.shape[1]]
        return float((weight * column).sum()) / total, float((weight * row).sum()) / total

    def gel_step(self, number: int, place: tuple[float, float]) -> GelStep:
        """Return the motion of the gel at a position (relief px) in a frame."""
        gel = self.gel[number]
        if gel is None:
            return UNKNOWN
        x, y = place[0] * self.scale, place[1] * self.scale
        arms = np.array([(x, y), (x + _ARM_PX, y), (x - _ARM_PX, y), (x, y + _ARM_PX), (x, y - _ARM_PX)], np.float32)
        moved = gel.at(arms[:, 0].copy(), arms[:, 1].copy())
        turn = (moved[1, 1] - moved[2, 1] - moved[3, 0] + moved[4, 0]) / (4 * _ARM_PX)
        return GelStep(float(moved[0, 0]), float(moved[0, 1]), float(turn))

    def gel_fixed(self, first: int, last: int, place: tuple[float, float]) -> tuple[Plane, list[GelStep]]:
        """Return the reliefs (k, h', w') of frames `first` to `last`, shifted by the gel's motion at `place` since
        the first of them, and the gel's steps."""
        whole, steps, shown = np.eye(3), [GelStep(0.0, 0.0, 0.0)], [self.relief[first]]
        size = (self.relief.shape[2], self.relief.shape[1])
        for number in range(first + 1, last + 1):
            now = tuple((whole @ (*place, 1.0))[:2])
            step = self.gel_step(number, (now[0], now[1]))
            steps.append(step)
            if not math.isnan(step.x):
                cos, sin = math.cos(step.turn), math.sin(step.turn)
                x, y = now[0] + step.x / self.scale, now[1] + step.y / self.scale
                turn = [[cos, -sin, x - cos * now[0] + sin * now[1]], [sin, cos, y - sin * now[0] - cos * now[1]]]
                whole = np.array([*turn, [0.0, 0.0, 1.0]]) @ whole
            flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
            shown.append(np.asarray(cv2.warpAffine(self.relief[number], whole[:2], size, flags=flags), np.float32))
        return np.array(shown), steps

    def moving(self) -> list[tuple[int, int]]:
        """Return the ranges of frames (first, last) with motion, and a margin of frames."""
        change = np.zeros(len(self))
        change[1:] = np.abs(np.diff(self.relief, axis=0)).mean(axis=(1, 2))
        worth = (self.moved_px > SHOWN_MOTION_PX) | (change > CHANGED * np.median(change[1:]))
        ranges: list[list[int]] = []
        for number in np.flatnonzero(worth).tolist():
            if ranges and number - ranges[-1][1] <= _FRAMES_APART:
                ranges[-1][1] = number
            else:
                ranges.append([number, number])
        return [(max(0, first - _FRAMES_BESIDE), min(len(self) - 1, last + _FRAMES_BESIDE)) for first, last in ranges]
