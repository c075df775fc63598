"""The events of a simulated clip, drawn from a seed: object, grip force (holding or not), and shaking motion.

Only what the recordings leave open is drawn here, and tuned: the object, its friction, the grip and the hand's motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from lsds_mocks.objects.catalogue import CATALOGUE, ObjectName
from lsds_mocks.plant.lift import GRAVITY_M_S2

if TYPE_CHECKING:
    from lsds_research.studies.realism.options import RealismOptions

OBJECTS: tuple[ObjectName, ...] = get_args(ObjectName)
FRICTION = (0.25, 1.2)
KINETIC_SHARE = (0.75, 0.95)
"""Kinetic over static friction."""
SLIP_SHARE, SLIP_GRIP = 0.4, (0.6, 1.4)
"""Clips in which the object is to slip; normal force over what carries it at rest: below 1 it stays on the table."""
FIRM_GRIP, FIRM_N = 1.5, (5.0, 20.0)
"""The others: at least this many times what carries it, and a hand's force."""
LEAST_N = 2.5
"""No hand grips more softly than this, so that the lightest objects do not slip."""
CLOSING_M_S = (0.02, 0.15)
GAP_M = 0.002
"""Between each pad and the object before the grip."""
ECCENTRIC_SHARE, ECCENTRIC_MM = 0.85, (2.0, 15.0)
"""Share of clips gripped off the centre of mass, and the offset."""
LIFT_M_S = (0.03, 0.12)
STROKE_M, SHAKE_HZ = (0.005, 0.05), (0.8, 4.0)
SHAKEN_SHARE = (0.1, 0.4)
"""How much of the time after the lift the hand shakes; it holds still for the rest, in turns."""
GRIPPED_SHARE = 0.5
"""Clips that begin with the object already held: in 49 % of the recordings the largest divergence is negative."""
RELEASED_SHARE, RELEASE = 0.85, (0.3, 0.95)
"""Clips in which the fingers open again; a part of the clip's length after which they do."""
PADS = ("5x7", "7x9", "8x10")
PAD_SHARE = (0.45, 0.19, 0.36)
"""As in the recordings' index, by the number of dots in the first frame."""
DIM_SHARE = 0.22


@dataclass(frozen=True, slots=True)
class Clip:
    """One clip. `cell` and `sensor` are options of the mocks; times (s) count from the first frame; `ajar_m` is
    the fingers' aperture before the grip, `turn_s` the length of a turn of shaking and stillness, `shaken` the
    shaking's share of it."""

    number: int
    frames: int
    cell: dict[str, Any]
    sensor: dict[str, Any]
    ajar_m: float
    force_n: float
    closing_m_s: float
    grip_s: float
    lift_s: float
    lift_m_s: float
    stroke_m: float
    shake_hz: float
    turn_s: float
    shaken: float
    release_s: float

    def hand_m_s(self, t_s: float) -> float:
        """Return the hand's upward velocity at a time: still, lift, then shaking and stillness in turns."""
        lifted_s = self.lift_s + 0.4
        if t_s < self.lift_s or t_s >= self.release_s:
            return 0.0
        if t_s < lifted_s:
            return self.lift_m_s
        in_turn = (t_s - lifted_s) % self.turn_s
        # Whole strokes only, so that the hand comes to rest where it began.
        strokes = max(1, round(self.turn_s * self.shaken * self.shake_hz))
        if in_turn >= strokes / self.shake_hz:
            return 0.0
        omega = 2 * math.pi * self.shake_hz
        return 0.5 * self.stroke_m * omega * math.sin(omega * in_turn)


def draw(options: RealismOptions, number: int) -> Clip:
    """Draw clip `number`; its objects take turns, so that 21 clips have shown the whole catalogue."""
    rng = np.random.default_rng([options.seed, number])
    name = OBJECTS[(number + options.seed) % len(OBJECTS)]
    static = rng.uniform(*FRICTION)
    frames = int(rng.integers(options.least_frames, options.most_frames, endpoint=True))
    duration_s = frames / options.rate_hz
    needed_n = CATALOGUE[name].mass_kg * GRAVITY_M_S2 / (2 * static)
    gripped = rng.random() < GRIPPED_SHARE
    grip_s = -1.5 if gripped else 0.1 + rng.uniform(0.0, 0.2 * duration_s)
    slips = rng.random() < SLIP_SHARE
    slipping_n, firm_n = needed_n * rng.uniform(*SLIP_GRIP), max(needed_n * FIRM_GRIP, _log_uniform(rng, FIRM_N))
    closing = rng.uniform(*CLOSING_M_S)
    beside = rng.uniform(*ECCENTRIC_MM) * rng.choice([-1, 1]) if rng.random() < ECCENTRIC_SHARE else 0.0
    cell = {
        "object": name,
        "static_friction": static,
        "kinetic_friction": static * rng.uniform(*KINETIC_SHARE),
        "centre_x_mm": float(np.clip(beside, -CATALOGUE[name].length_mm / 3, CATALOGUE[name].length_mm / 3)),
        "fidelity": options.fidelity,
        "grid": options.grid,
        "step_ms": options.step_ms,
    }
    sensor = {
        "pad": str(rng.choice(PADS, p=PAD_SHARE)),
        "dot_diameter_px": rng.uniform(11.6, 17.3),
        "dot_core": rng.uniform(0.28, 0.35),
        "mm_per_px": rng.uniform(0.0581, 0.0634),
        "brightness": rng.uniform(0.9, 1.2),
        "dim_start": bool(rng.random() < DIM_SHARE),
        "rate_hz": options.rate_hz,
        # Every frame is to be seen once and in order: no tail that lets two arrive together.
        "latency_jitter_ms": 0.0,
    }
    return Clip(
        number=number,
        frames=frames,
        cell=cell,
        sensor=sensor,
        ajar_m=CATALOGUE[name].diameter_mm * 1e-3 + 2 * GAP_M,
        force_n=max(LEAST_N, slipping_n if slips else firm_n),
        closing_m_s=closing,
        grip_s=grip_s,
        lift_s=-0.5 if gripped else grip_s + GAP_M * 2 / closing + 0.2 + rng.uniform(0.0, 0.5),
        lift_m_s=rng.uniform(*LIFT_M_S),
        stroke_m=_log_uniform(rng, STROKE_M),
        shake_hz=_log_uniform(rng, SHAKE_HZ),
        turn_s=rng.uniform(1.0, 3.0),
        shaken=rng.uniform(*SHAKEN_SHARE),
        release_s=duration_s * (rng.uniform(*RELEASE) if rng.random() < RELEASED_SHARE else 2.0),
    )


def _log_uniform(rng: np.random.Generator, limits: tuple[float, float]) -> float:
    return math.exp(rng.uniform(math.log(limits[0]), math.log(limits[1])))
