"""Frames and observations of a gel at rest, in stick, in slip, turned, with lost markers and without anything to see.

They are computed once from exact positions, the same in every process.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lsds.contracts import (
    DeformationField,
    FeatureVector,
    FingerCycle,
    Frame,
    MarkerReference,
    MarkerTracks,
    Observation,
    SlipEstimate,
)
from lsds.contracts.values import ABSTAINED, Detection, TrackFlag
from lsds.tactile.options import TactileOptions
from lsds.tactile.perception import Perception
from lsds.testing.gel import CENTRE_PX, CONTACT_PX, PITCH_PX, SPEC, Press, draw, grid_px

FRAME_NS = 40_000_000
"""Interval of the frames, 25 Hz."""
Name = Literal["slides", "turns", "untouched"]


@dataclass(frozen=True)
class Scene:
    """The content of one frame: displaced markers (N, 2) in px, NaN where lost, and the object in contact, if any."""

    markers_px: NDArray[np.float64]
    press: Press | None = None


def reference() -> MarkerReference:
    """Return the markers of the gel at rest."""
    grid = grid_px()
    rows, columns = SPEC.pad or (0, 0)
    cell = np.stack(np.divmod(np.arange(len(grid)), columns), axis=1)
    size = (SPEC.width_px, SPEC.height_px)
    return MarkerReference(grid, cell, (rows, columns), (PITCH_PX, PITCH_PX), np.eye(2), size)


@cache
def frames(name: Name) -> tuple[Frame, ...]:
    """Return the frames of a sequence, images read-only."""
    return tuple(
        Frame(draw(scene.markers_px, scene.press, seed=i), (i + 1) * FRAME_NS, i)
        for i, scene in enumerate(_scenes(name))
    )


@cache
def rest_frame() -> Frame:
    """Return a frame of the gel at rest, without contact."""
    return Frame(draw(grid_px(), seed=999), 0, 0)


@cache
def observations(name: Name) -> tuple[Observation, ...]:
    """Return the observations of a sequence; everything in them is computed already."""
    return tuple(cycle.observation for cycle in cycles(name))


@cache
def cycles(name: Name) -> tuple[FingerCycle, ...]:
    """Return the cycles of one finger in a sequence; their detections abstain."""
    perception = Perception(_KnownTracker(_scenes(name)), SPEC, TactileOptions())
    perception.start([rest_frame()])
    seen = []
    for frame in frames(name):
        observation, tracks = perception.observe(frame)
        seen.append(_cycle(_computed(observation), tracks))
    return tuple(seen)


@cache
def degraded() -> dict[str, Observation]:
    """Return defective observations, by the name of the defect."""
    sound = observations("slides")[-1]
    some = np.arange(len(sound.field.valid)) % 3 == 0
    none = np.zeros(len(some), bool)
    bare = replace(sound, frame=None, evidence=None, imprint=None, load=None, contact=None)
    black = np.zeros((SPEC.height_px, SPEC.width_px, 3), np.uint8)
    black.flags.writeable = False
    gone = replace(bare, field=_only(sound.field, none), features=_undefined(sound.features), lost_share=0.0)
    return {
        "features of NaN": replace(sound, features=_undefined(sound.features)),
        "a third of the markers lost": replace(sound, field=_only(sound.field, ~some), lost_share=0.3),
        "no marker followed": gone,
        "nothing but field and features": bare,
        "a field of NaN whose markers are valid": replace(bare, field=_only(sound.field, none, flagged=False)),
        "the first frame, without a velocity": replace(
            gone, dt_s=math.nan, field=replace(_only(sound.field, none), dt_s=math.nan)
        ),
        "a black image": replace(gone, frame=Frame(black, sound.t_ns, sound.seq)),
        "no contact": replace(sound, contact=None, imprint=None, load=None),
    }


def later(observation: Observation, frames: int) -> Observation:
    """Return an observation as if it was seen a number of frames later."""
    t_ns, seq = observation.t_ns + frames * FRAME_NS, observation.seq + frames
    image = observation.frame
    frame = None if image is None else Frame(image.image, t_ns, seq)
    return replace(observation, t_ns=t_ns, seq=seq, frame=frame)


def _scenes(name: Name) -> list[Scene]:
    grid = grid_px()
    rng = np.random.default_rng([3, *name.encode()])
    inside = np.exp(-((grid - CENTRE_PX) ** 2).sum(axis=1) / CONTACT_PX**2)[:, None]
    scenes = []
    for i in range(20):
        jitter = 0.03 * rng.standard_normal(grid.shape)
        if name == "untouched" or i < 4:
            scenes.append(Scene(grid + jitter))
            continue
        grown, slipped = min(i - 3, 6) / 6, max(i - 9, 0)
        if name == "slides":
            along = np.array([0.0, 1.0])
            slip = 0.5 * (slipped > 0) * rng.standard_normal((len(grid), 1)) * along
            moved = inside * (4 * grown * along + slip)
            scenes.append(Scene(grid + moved + jitter, Press(0.0, 4 * grown + 5 * slipped, depth=grown)))
            continue
        angle = 0.08 * grown
        turned = (grid - CENTRE_PX) @ np.array([[0.0, 1.0], [-1.0, 0.0]]) * angle
        markers = grid + inside * turned + jitter
        if i > 16:
            markers[rng.permutation(len(grid)) < 20] = math.nan
        scenes.append(Scene(markers, Press(turn_rad=angle + 0.03 * slipped, depth=grown)))
    return scenes


class _KnownTracker:
    """A tracker that returns the positions that the frames were drawn from."""

    def __init__(self, scenes: list[Scene]) -> None:
        self._scenes = scenes

    def start(self, frame: Frame, pad: tuple[int, int] | None = None) -> MarkerReference:
        return reference()

    def update(self, frame: Frame) -> MarkerTracks:
        markers = self._scenes[frame.seq].markers_px
        valid = np.asarray(np.isfinite(markers).all(axis=1))
        flags = np.where(valid, TrackFlag.OK.value, TrackFlag.LOST.value).astype(np.uint8)
        return MarkerTracks(frame.t_ns, frame.seq, markers.copy(), valid, flags)

    def reset(self) -> None:
        return None


class _KnownImprint:
    """An `Imprint` with known answers: it may be called at any time and in any order."""

    def __init__(self, motions: list[Any], own: Any) -> None:
        self._motions, self._own = motions, own

    def __call__(self) -> Any:
        return self._own

    def recent(self) -> list[Any]:
        return list(self._motions)


def _computed(observation: Observation) -> Observation:
    if observation.evidence is not None:
        observation.evidence()
    if observation.imprint is None:
        return observation
    imprint = _KnownImprint(observation.imprint.recent(), observation.imprint())
    return replace(observation, imprint=imprint)


def _cycle(observation: Observation, tracks: MarkerTracks) -> FingerCycle:
    frame = observation.frame if observation.frame is not None else rest_frame()
    silent = Detection(None, math.nan, 0.5, 0.0)
    estimate: SlipEstimate = ABSTAINED
    return FingerCycle("left", frame, tracks, observation, silent, estimate)


def _undefined(features: FeatureVector) -> FeatureVector:
    return replace(features, values=np.full_like(features.values, math.nan))


def _only(field: DeformationField, kept: NDArray[np.bool_], *, flagged: bool = True) -> DeformationField:
    """Return the field with NaN for all markers but those; without `flagged` they still count as valid."""
    lost = ~kept[:, None]
    return replace(
        field,
        displacement_m=np.where(lost, math.nan, field.displacement_m),
        velocity_m_s=np.where(lost, math.nan, field.velocity_m_s),
        valid=field.valid & kept if flagged else field.valid,
    )
