"""The protocols as trials: the sequence of moves of fingers and arm.

Detection, an object about three minutes: STATIC, five ever tighter grasps, ten trajectories in each with the object
lifted; GRASP, from first touch ten ticks tighter, with pauses; SLIP, in half of it the object is clamped and dragged
through the grip, in the other half it is lifted with too little force. Severity: clamped, the grip slides up at five
velocities, five repeats of each, off the object's end; in addition to the paper, the grip also rotates about the
object. Pipe: like severity, on the demonstration's object and at its arm speed.
Catch, not in the paper: the fingers close while the object slips, as in the closed loop.
Loads, not in the paper: a firmly held object is lifted, shaken, filled, shoved and lowered; the load changes and
nothing slips.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from lsds.errors import DataError
from lsds.registry.backends import did_you_mean
from lsds_research.collecting.objects import PIPE, PLANS, SEEN, UNSEEN

Job = Literal["detection", "severity", "pipe", "catch", "loads"]
STUDY: tuple[Job, ...] = ("detection", "severity", "pipe")
"""Objects of the study's tables."""

HAND_E_TICK_M = 50e-3 / 230
"""A Hand-E's register counts 230 from open to closed."""
SPEEDS_M_S = (0.008, 0.023, 0.038, 0.045, 0.067)
"""Five velocities of the arm in the severity protocol (arXiv 2411.07442), m/s."""
RATES_RAD_S = (0.3, 0.6, 1.0, 1.5, 2.2)
"""Angular velocities of the grip in the turns, rad/s; chosen, since the paper has no turns."""
STATIC_GRASPS = 5
"""Number of static grasps of an object."""
TRAJECTORIES = 10
"""Number of trajectories for each of them."""
GRASP_TICKS = 10
"""Number of ticks by which a grasp tightens, one after the other."""
REPEATS = 5
"""Number of repetitions at each speed."""
PAUSE_S = 5.0
"""Duration of the pause after each tick of a GRASP recording, s; chosen."""
QUICK_OBJECTS = 6
"""Number of training objects in a quick campaign."""
DRAGS = 12
"""Number of slip recordings by dragging: with the lifts, a third of all frames slip, as in the study."""
LIFTS = 12
"""Number of slip recordings by lifting."""
STROKES = 6
"""Number of strokes in a slip recording."""
FIRM = (1.7, 4.0)
"""Range of the force on held objects, relative to the force that carries the object."""
LOOSE = (0.45, 0.95)
"""Range of the force on slipping objects, relative to the force that carries the object."""
DRAG_N = (1.0, 9.0)
"""Range of the normal force per finger on clamped objects, N; chosen."""
CATCHES = 12
"""Number of catch recordings."""
CLOSED_TO = (0.8, 5.0)
"""Range of the catching force, relative to the force that carries the object."""
LOADS = 9
"""Number of recordings of changing load."""
STROKES_SHAKEN = 10
"""Number of strokes up and down in a recording of changing load."""
SHAKE_HZ = (0.7, 3.5)
"""Range of strokes per second."""
SHAKE_M_S = (0.03, 0.1)
"""Range of the speed of these strokes, m/s."""
SHAKE_M_S2 = (0.3, 2.0)
"""Range of the arm's acceleration in them, m/s^2. A sharp turn loads the gel within a frame."""
G_M_S2 = 9.81
"""Acceleration of gravity, m/s^2."""
HELD = (1.8, 4.0)
"""Ratio of force to the force that carries the shaken object, including poured mass and pushes."""
CATCH_LIFT_M_S = (0.012, 0.06)
"""Range of the arm's velocity in a catch, m/s; chosen."""
CHATTER = (0.25, 0.6)
"""Range of the unevenness of simulated surfaces while they slide.

The upper end comes closest to the trembling of markers in the study's released sample while slipping (median 11 px/s,
95 % below 53).
"""
SLOW_CLOSING_M_S = 0.03
"""Speed at which the fingers close on an object (m/s)."""
TRIAL_REST_S = 0.6
"""Time at rest that surrounds the moves of a trial, s; chosen."""
PAST_END_M = 14e-3
"""Travel of the grip after its middle has reached the object's end; the pad is then off the object (m)."""
SLIDE_M = 45e-3
"""Distance from the pads to the object's end in the severity protocol (m)."""


@dataclass(frozen=True, slots=True)
class Move:
    """A move: for `duration_s` the arm rises at `velocity_m_s` and rotates at `turn_rad_s`; at its start the fingers go
    to `aperture_m` at `closing_m_s`, None leaves them."""

    duration_s: float
    velocity_m_s: float = 0.0
    turn_rad_s: float = 0.0
    aperture_m: float | None = None
    closing_m_s: float = SLOW_CLOSING_M_S


@dataclass(frozen=True, slots=True)
class Trial:
    """One recording. `simulated` are options that vary (dotted paths of the config), `clamped` whether the
    object is to be clamped to the table, `end_m` how far the grip rises along it until its middle is at its end."""

    recording: str
    object: str
    protocol: str
    condition: str
    seed: int
    clamped: bool
    grip_aperture_m: float
    moves: tuple[Move, ...]
    simulated: dict[str, Any]
    end_m: float = math.inf


def trials(job: Job, objects: Sequence[str] | None, seed: int, *, quick: bool = False) -> list[Trial]:
    """Return a job's trials, the same for the same arguments; `quick` is less than a tenth of it.

    Raises DataError for an object that has no plan.
    """
    usual = (PIPE,) if job == "pipe" else (*(SEEN[:QUICK_OBJECTS] if quick else SEEN), *UNSEEN)
    names = tuple(dict.fromkeys(objects)) if objects else usual
    unknown = [name for name in names if name not in PLANS]
    if unknown:
        hints = {did_you_mean(name, PLANS) for name in unknown} - {""}
        raise DataError(f"no plan for {', '.join(unknown)}; {' '.join(hints) or 'there are ' + ', '.join(PLANS)}")
    make = {"detection": _detection, "severity": _severity, "pipe": _pipe, "catch": _catch, "loads": _loads}[job]
    return [trial for name in names for trial in make(name, seed, quick)]


def _detection(name: str, seed: int, quick: bool) -> list[Trial]:
    plan = PLANS[name]
    found = []
    grasps = (2,) if quick else range(STATIC_GRASPS)
    for grasp in grasps:
        rng, start = _start(name, "static", grasp, seed)
        share = FIRM[0] + (FIRM[1] - FIRM[0]) * (grasp + rng.uniform(0, 0.8)) / STATIC_GRASPS
        lift = Move(0.35, rng.uniform(0.03, 0.08))
        moves = [Move(0.6), lift, Move(0.3)]
        height = lift.duration_s * lift.velocity_m_s
        for _ in range(4 if quick else TRAJECTORIES):
            velocity, duration = rng.uniform(-0.1, 0.1), rng.uniform(0.3, 0.9)
            # It stays above the table and within reach.
            if not 0.01 < height + velocity * duration < 0.15:
                velocity = -velocity
            duration = min(duration, max((height - 0.005) / -velocity, 0.05)) if velocity < 0 else duration
            height += velocity * duration
            moves += [Move(duration, velocity), Move(rng.uniform(0.1, 0.5))]
        aperture = plan.aperture_m(max(share * plan.needed_n, 0.4))
        found.append(Trial(**start, clamped=False, grip_aperture_m=aperture, moves=tuple(moves)))
    rng, start = _start(name, "grasp", 0, seed)
    first = plan.aperture_m(max(0.3, 0.5 * plan.needed_n))
    ticks = range(1, (3 if quick else GRASP_TICKS) + 1)
    pauses = tuple(Move(1.0 if quick else PAUSE_S, aperture_m=max(0.0, first - tick * HAND_E_TICK_M)) for tick in ticks)
    found.append(Trial(**start, clamped=False, grip_aperture_m=first, moves=(Move(TRIAL_REST_S), *pauses)))
    found += [_dragged(name, k, seed) for k in range(1 if quick else DRAGS)]
    found += [_lifted_loosely(name, k, seed) for k in range(1 if quick else LIFTS)]
    return found


def _dragged(name: str, number: int, seed: int) -> Trial:
    """Return the moves of a clamped object under a sliding grip: up, rest, down, with changes of grip."""
    rng, start = _start(name, "slip", number, seed)
    plan = PLANS[name]
    force = _log_uniform(rng, DRAG_N)
    room = min(0.3 * plan.length_mm, 40.0) * 1e-3
    moves, height = [Move(rng.uniform(0.3, 0.8))], 0.0
    for _ in range(STROKES):
        speed = _log_uniform(rng, (0.006, 0.09))
        way = min(rng.uniform(0.3, 1.0) * room, 1.4 * speed)
        up = height + way <= room and (height < way or rng.random() < 0.5)
        height += way if up else -way
        turn = rng.choice((0.0, rng.uniform(-1.5, 1.5)))
        moves += [Move(way / speed, speed if up else -speed, turn), Move(rng.uniform(0.05, 0.3))]
    start["simulated"]["cell.simulated.grip_height_mm"] = 0.4 * plan.length_mm
    return Trial(**start, clamped=True, grip_aperture_m=plan.aperture_m(force), moves=tuple(moves))


def _lifted_loosely(name: str, number: int, seed: int) -> Trial:
    """Return the moves of a lift with too little force: the object slides out under its weight or stays on the
    table."""
    rng, start = _start(name, "slip", 100 + number, seed)
    plan = PLANS[name]
    share = rng.uniform(*LOOSE)
    aperture = plan.aperture_m(max(share * plan.needed_n, 0.05))
    speed = rng.uniform(0.01, 0.06)
    room = min(0.5 * plan.length_mm, 50.0) * 1e-3
    moves = (Move(rng.uniform(0.3, 0.8)), Move(min(room / speed, 2.0), speed), Move(0.5))
    return Trial(**start, clamped=False, grip_aperture_m=aperture, moves=moves)


def _severity(name: str, seed: int, quick: bool) -> list[Trial]:
    speeds, repeats = (SPEEDS_M_S[2::2], 1) if quick else (SPEEDS_M_S, REPEATS)
    found = [_slide(name, "severity", speed, repeat, seed) for speed in speeds for repeat in range(repeats)]
    one_way = 1 if zlib.crc32(name.encode()) % 2 else -1
    turns = [(RATES_RAD_S[2], one_way)] if quick else [(rate, sign) for rate in RATES_RAD_S for sign in (1, -1)]
    return found + [_turn(name, rate, sign, seed) for rate, sign in turns]


def _pipe(name: str, seed: int, quick: bool) -> list[Trial]:
    return [_slide(name, "pipe", 0.038, repeat, seed) for repeat in range(2 if quick else 2 * REPEATS)]


def _catch(name: str, seed: int, quick: bool) -> list[Trial]:
    return [_caught(name, k, seed) for k in range(2 if quick else CATCHES)]


def _caught(name: str, number: int, seed: int) -> Trial:
    """Return the moves of a lift with too little force, in which the fingers close on the sliding object until they
    carry it.

    The fingers close in one or several steps. One object in four is clamped and slides until the arm rests."""
    rng, start = _start(name, "catch", number, seed)
    plan, clamped = PLANS[name], number % 4 == 3
    loose, tight = max(rng.uniform(*LOOSE) * plan.needed_n, 0.05), _log_uniform(rng, CLOSED_TO) * plan.needed_n
    speed = _log_uniform(rng, CATCH_LIFT_M_S)
    moves = [Move(rng.uniform(0.2, 0.6)), Move(rng.uniform(0.1, 0.5), speed)]
    steps = int(rng.integers(1, 7))
    forces = np.geomspace(loose, max(tight, 1.2 * loose), steps + 1)[1:].tolist()
    moves += [
        Move(rng.uniform(0.04, 0.15), speed, 0.0, plan.aperture_m(force), rng.uniform(0.02, 0.1)) for force in forces
    ]
    moves += [Move(rng.uniform(0.2, 0.6), speed), Move(rng.uniform(0.3, 1.0))]
    if clamped:
        start["simulated"]["cell.simulated.grip_height_mm"] = 0.4 * plan.length_mm
    return Trial(**start, clamped=clamped, grip_aperture_m=plan.aperture_m(loose), moves=tuple(moves))


def _loads(name: str, seed: int, quick: bool) -> list[Trial]:
    return [_loaded(name, k, seed) for k in range(2 if quick else LOADS)]


def _loaded(name: str, number: int, seed: int) -> Trial:
    """Return the moves of a firmly held object: lifted, shaken at changing rates, lowered; in every third trial it is
    filled or shoved."""
    rng, start = _start(name, "loads", number, seed)
    plan, simulated = PLANS[name], start["simulated"]
    acceleration = _log_uniform(rng, SHAKE_M_S2)
    simulated["task.lift_acceleration_m_s2"] = acceleration
    share = rng.uniform(*HELD) * (1 + acceleration / G_M_S2)
    simulated["cell.simulated.changes_after_s"] = rng.uniform(0.5, 4.0)
    if number % 3 == 1:
        simulated["cell.simulated.pour_to"] = poured = rng.uniform(1.3, 2.0)
        simulated["cell.simulated.pour_s"] = rng.uniform(0.5, 3.0)
        share *= poured
    elif number % 3 == 2:
        # In units of the force of one finger: both fingers carry, and friction is about 0.5.
        simulated["cell.simulated.shove_n"] = pushed = rng.uniform(0.3, 1.0) * plan.needed_n
        simulated["cell.simulated.shove_s"] = rng.uniform(0.08, 0.4)
        share += pushed / plan.needed_n
    lift = Move(rng.uniform(0.5, 1.0), rng.uniform(0.03, 0.06))
    moves = [Move(rng.uniform(0.4, 0.8)), lift, Move(rng.uniform(0.1, 0.4))]
    for _ in range(STROKES_SHAKEN):
        half_s, speed = 0.5 / _log_uniform(rng, SHAKE_HZ), _log_uniform(rng, SHAKE_M_S)
        moves += [Move(half_s, speed), Move(half_s, -speed)]
    moves += [Move(rng.uniform(0.2, 0.6)), Move(lift.duration_s, -lift.velocity_m_s), Move(0.4)]
    aperture = plan.aperture_m(max(share * plan.needed_n, 0.5))
    return Trial(**start, clamped=False, grip_aperture_m=aperture, moves=tuple(moves))


def _slide(name: str, protocol: str, speed: float, repeat: int, seed: int) -> Trial:
    rng, start = _start(name, protocol, repeat, seed, f"{speed * 100:g}cm_s")
    plan = PLANS[name]
    force = _log_uniform(rng, DRAG_N)
    way = min(SLIDE_M, 0.6e-3 * plan.length_mm)
    moves = (
        Move(rng.uniform(0.5, 1.5) * TRIAL_REST_S),
        Move((way + PAST_END_M) / speed, speed),
        Move(1.2 * TRIAL_REST_S),
    )
    start["simulated"]["cell.simulated.grip_height_mm"] = plan.length_mm - way * 1e3
    return Trial(**start, clamped=True, grip_aperture_m=plan.aperture_m(force), moves=moves, end_m=way)


def _turn(name: str, rate: float, sign: int, seed: int) -> Trial:
    rng, start = _start(name, "turn", sign > 0, seed, f"{sign * rate:g}rad_s")
    plan = PLANS[name]
    force = _log_uniform(rng, DRAG_N)
    drift = rng.choice((0.0, rng.uniform(-0.02, 0.02)))
    moves = (Move(rng.uniform(0.5, 1.0)), Move(min(2.5, 1.5 / rate), drift, sign * rate), Move(0.8))
    start["simulated"]["cell.simulated.grip_height_mm"] = 0.5 * plan.length_mm
    return Trial(**start, clamped=True, grip_aperture_m=plan.aperture_m(force), moves=moves)


def _start(
    name: str, protocol: str, number: int, seed: int, condition: str = ""
) -> tuple[np.random.Generator, dict[str, Any]]:
    """Return a separate random stream and the options common to all trials. Gel, camera and friction vary from trial to
    trial."""
    label = f"{name}__{protocol}{'__' + condition if condition else ''}__{int(number)}"
    own = zlib.crc32(label.encode())
    rng = np.random.default_rng([seed, own])
    simulated: dict[str, Any] = {
        "cell.simulated.object": name,
        "sensor.mock-gelsight-mini.gel": int(rng.integers(0, 1000)),
        "sensor.mock-gelsight-mini.rate_hz": float(rng.choice((25.0, 25.0, 18.5, 12.0, 10.0))),
        "sensor.mock-gelsight-mini.jitter_ms": rng.uniform(1.0, 6.0),
        "sensor.mock-gelsight-mini.duplicate_probability": 0.012,
        "sensor.mock-gelsight-mini.drop_probability": rng.uniform(0.0, 0.03),
        "sensor.mock-gelsight-mini.swing_levels": float(min(rng.exponential(3.0), 15.0)),
        "cell.simulated.friction_scale": rng.uniform(0.85, 1.15),
        "cell.simulated.chatter_amplitude": rng.uniform(*CHATTER),
    }
    start = {
        "recording": label,
        "object": name,
        "protocol": protocol,
        "condition": condition,
        "seed": int(rng.integers(0, 2**31)),
        "simulated": simulated,
    }
    return rng, start


def _log_uniform(rng: np.random.Generator, limits: tuple[float, float]) -> float:
    return float(np.exp(rng.uniform(np.log(limits[0]), np.log(limits[1]))))
