"""Run a gel model through a scene, and record its markers, forces and time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds.clock import perf_ns

if TYPE_CHECKING:
    from lsds_mocks.gel.protocol import GelModel, Reaction
    from numpy.typing import NDArray

    from lsds_research.studies.gel.scenes import Scene


_PAD_M = (24.96e-3, 20.16e-3)
"""Width and height of the pad, m: those of `GelMaterial`."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """Dots (frames, M, 2) and forces (frames, 4: x, y, torque, normal) after pressing and after each frame, stuck area
    (frames,) in square metres, and the time that each frame took (frames - 1,)."""

    dots_m: NDArray[np.float64]
    forces: NDArray[np.float64]
    stuck_m2: NDArray[np.float64]
    frame_ns: NDArray[np.int64]


def _settled(gel: GelModel, friction: float, motion: Sequence[float]) -> Reaction:
    # Cells may change during a run; friction belongs to the scene, not to a cell.
    gel.set_friction(np.full(gel.points_m.shape[1], friction))
    reaction = gel.trial(*motion)
    gel.commit()
    return reaction


def _forces(reaction: Reaction) -> tuple[float, float, float, float]:
    return reaction.force_x_n, reaction.force_y_n, reaction.torque_nm, reaction.normal_n


def lead(gel: GelModel, scene: Scene, xy_m: NDArray[np.float64], parts: int = 1) -> Trace:
    """Return the trace of a gel in a scene, each frame's motion in `parts` steps; markers are recorded once per
    frame."""
    answers = []
    for step in range(1, scene.presses + 1):
        gel.press(step / scene.presses * scene.indentation_m)
        answers.append(_settled(gel, scene.friction, (0.0, 0.0)))
    dots = [gel.marker_displacement(gel.state(), xy_m)]
    forces = [_forces(answers[-1])]
    stuck = [_stuck_m2(gel)]
    times = []
    for motion in scene.frames:
        begun = perf_ns()
        answers = [_settled(gel, scene.friction, [part / parts for part in motion]) for _ in range(parts)]
        moved = gel.marker_displacement(gel.state(), xy_m)
        times.append(perf_ns() - begun)
        dots.append(moved)
        forces.append(_forces(answers[-1]))
        stuck.append(_stuck_m2(gel))
    return Trace(np.array(dots), np.array(forces), np.array(stuck), np.array(times))


def _stuck_m2(gel: GelModel) -> float:
    width, height = _PAD_M
    return gel.stick_ratio * gel.contact_fraction(gel.state(), width, height) * width * height


def rms_m(trace: Trace, truth: NDArray[np.float64]) -> tuple[float, float]:
    """Return the dots' RMS error over all frames of motion, and of the worst frame; `truth` (frames, M, 2)."""
    square = ((trace.dots_m - truth) ** 2).sum(axis=2).mean(axis=1)[1:]
    return float(np.sqrt(square.mean())), float(np.sqrt(square.max()))


def timed(
    make: Callable[[], GelModel], scene: Scene, xy_m: NDArray[np.float64], repeats: int
) -> tuple[Trace, NDArray[np.float64]]:
    """Return the last trace and the times in microseconds (repeats, frames - 1)."""
    traces = [lead(make(), scene, xy_m) for _ in range(repeats)]
    return traces[-1], np.array([trace.frame_ns for trace in traces]) / 1e3
