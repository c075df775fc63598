"""Scenes for gel models: a surface, its indentation depth, and its motion frame by frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.shapes import Box, Cylinder, Moved, Sphere
from lsds_mocks.objects.relief import MAP_PITCH_M, Relief, bumps

from lsds.errors import DataError

if TYPE_CHECKING:
    from lsds_mocks.gel.shapes import Shape

Motion = tuple[float, float, float]
"""Motion of one frame: dx, dy (m) and turn (rad) about the pad's centre."""
_PAD_LENGTH_M = 20.16e-3
"""Length of the pad, m: that of `GelMaterial`."""


@dataclass(frozen=True, eq=False)
class Scene:
    """`frames` follow after the object has been pressed in by `presses` equal steps; with `follows` its surface moves
    over the gel with it."""

    name: str
    shape: Shape
    indentation_m: float
    friction: float
    frames: tuple[Motion, ...]
    presses: int = 5
    follows: bool = True
    material: GelMaterial = field(default_factory=GelMaterial)


def _straight(frames: int, dx: float, dy: float = 0.0, turn: float = 0.0) -> tuple[Motion, ...]:
    return ((dx, dy, turn),) * frames


def reference_scenes() -> dict[str, Scene]:
    """Return the four scenes of the published reference solutions: surfaces stay in place while the gel is dragged."""
    sphere, block = Sphere(12e-3), Box(10e-3, 10e-3, 0.5e-3)
    pipe = Cylinder(12.5e-3, _PAD_LENGTH_M / math.cos(0.35), 0.35)
    scenes = (
        Scene("sphere", sphere, 0.4e-3, 0.6, _straight(14, 0.05e-3), follows=False),
        Scene("torsion", sphere, 0.4e-3, 0.6, _straight(14, 0.0, 0.0, 0.03), follows=False),
        Scene("pipe", pipe, 0.3e-3, 0.6, _straight(14, 0.04e-3, 0.06e-3), follows=False),
        Scene("block", block, 0.15e-3, 0.6, _straight(14, 0.04e-3), follows=False),
    )
    return {scene.name: scene for scene in scenes}


def further_scenes() -> dict[str, Scene]:
    """Return scenes without a published solution: wide, sharp, rough; compared with the finest grid."""
    rng = np.random.default_rng(0)
    rough = Relief(Sphere(20e-3), bumps(rng, size_m=2e-3, depth_m=0.1e-3), MAP_PITCH_M)
    scenes = (
        Scene("plank", Box(60e-3, 60e-3, 1e-3), 0.1e-3, 0.6, _straight(14, 0.0, 0.05e-3)),
        Scene("edge", Cylinder(1e-3, _PAD_LENGTH_M, 0.15), 0.35e-3, 0.6, _straight(14, 0.0, 0.05e-3)),
        Scene("rough", rough, 0.4e-3, 0.6, _straight(14, 0.05e-3)),
    )
    return {scene.name: scene for scene in scenes}


def named_scenes(names: Sequence[str]) -> dict[str, Scene]:
    """Return scenes by name, by default all. Raises DataError for an unknown name."""
    known = reference_scenes() | further_scenes()
    wrong = [name for name in names if name not in known]
    if wrong:
        raise DataError(f"no scene '{wrong[0]}': the scenes are {', '.join(known)}")
    return {name: known[name] for name in names or known}


def random_scene(seed: int) -> Scene:
    """Return a scene drawn by seed: sphere, cylinder, edge or block, anywhere, along a path with turns."""
    rng = np.random.default_rng([seed, 4])
    kind = ("sphere", "cylinder", "edge", "block")[int(rng.integers(4))]
    angle = float(rng.uniform(-math.pi / 2, math.pi / 2))
    shape: Shape
    if kind == "sphere":
        shape, deepest = Sphere(float(rng.uniform(4e-3, 25e-3))), 0.4e-3
    elif kind == "cylinder":
        shape, deepest = Cylinder(float(rng.uniform(5e-3, 20e-3)), _PAD_LENGTH_M, angle), 0.35e-3
    elif kind == "edge":
        shape, deepest = Cylinder(float(rng.uniform(0.8e-3, 4e-3)), _PAD_LENGTH_M, angle), 0.35e-3
    else:
        width, height = rng.uniform(5e-3, 14e-3, 2)
        shape, deepest = Box(float(width), float(height), float(rng.uniform(0.3e-3, 1.5e-3)), angle), 0.2e-3
    offset = rng.uniform(-1, 1, 2) * (4e-3, 3e-3)
    return Scene(
        f"{kind} {seed}",
        Moved(shape, float(offset[0]), float(offset[1])),
        float(rng.uniform(0.3, 1.0)) * deepest,
        float(rng.uniform(0.3, 1.5)),
        _path(rng),
    )


def _path(rng: np.random.Generator) -> tuple[Motion, ...]:
    """Three to five straight pieces, each of 6 to 15 frames."""
    frames: list[Motion] = []
    heading = float(rng.uniform(0, 2 * math.pi))
    for _ in range(int(rng.integers(3, 6))):
        speed = float(rng.uniform(10e-6, 80e-6))
        turn = float(rng.normal(0, 0.006))
        step = (speed * math.cos(heading), speed * math.sin(heading), turn)
        frames += [step] * int(rng.integers(6, 16))
        heading += math.pi if rng.uniform() < 0.3 else float(rng.uniform(-2, 2))
    return tuple(frames)
