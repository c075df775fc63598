"""Synthetic windows of signals with heavy tails, zeros and groups as in real data, and truths correlated with them."""

from __future__ import annotations

import numpy as np
from lsds_research.datasets import from_rows, joined

from lsds.contracts.learning import Examples
from lsds.models.signals import SIGNAL_SETS, SIGNALS

UNIT = 1e-4


def recordings(rows: int, seed: int = 0, group_rows: int = 200):
    """(rows,) slip, (rows, 3) velocities, (rows, 2) log loudness and direction, group: slip comes in stretches."""
    rng = np.random.default_rng(seed)
    group = np.arange(rows) // group_rows
    moving = np.repeat(rng.random(rows // 25 + 1) < 0.42, 25)[:rows]
    speed = np.repeat(rng.choice([0.008, 0.023, 0.038, 0.045, 0.067], rows // 25 + 1), 25)[:rows] * moving
    angle = rng.normal(np.pi / 2, 0.4, rows // group_rows + 1)[group]
    turn = np.repeat(rng.normal(0, 0.6, rows // 25 + 1), 25)[:rows] * moving
    y = np.stack([speed * np.cos(angle), speed * np.sin(angle), turn], axis=1).astype(np.float32)
    return moving, y, group


def examples(job: str, names, length: int, rows: int = 5000, seed: int = 0) -> Examples:
    """Examples of a job: heavy-tailed signals, the louder the faster, with an object's own gain."""
    names = SIGNAL_SETS[names] if isinstance(names, str) else tuple(names)
    moving, y, group = recordings(rows, seed)
    rng = np.random.default_rng([seed, 1])
    width = len(names)
    speed = np.hypot(y[:, 0], y[:, 1])
    gain = rng.lognormal(0, 0.4, group.max() + 1)[group]
    loud = (UNIT * (1 + 60 * speed * gain + 0.4 * np.abs(y[:, 2])))[:, None]
    values = loud * np.exp(0.6 * rng.standard_normal((rows, width)))
    signed = np.arange(width) % 3 == 2
    way = np.where(np.arange(width)[None] % 2, y[:, :1] + y[:, 1:2], y[:, 2:]) * UNIT * 30
    values[:, signed] = (way + loud * rng.standard_t(3, (rows, width)))[:, signed]
    # Rare enormous frames, as when a dot jumps, and frames with exactly nothing.
    values[rng.random(rows) < 0.002] *= 1e3
    values[rng.random((rows, width)) < 0.02] = 0.0
    values = values.astype(np.float32)
    first = np.maximum.accumulate(np.where(np.r_[True, group[1:] != group[:-1]], np.arange(rows), 0))
    back = np.maximum(np.arange(rows)[:, None] + np.arange(1 - length, 1), first[:, None])
    return Examples(values[back], moving.astype(np.float32) if job == "detect" else y, group.astype(np.intp))


def recording(name, object_name, seed, frames=80, protocol="slip"):
    """A slip of one second; the speed of the field shows it, with noise."""
    rng = np.random.default_rng(seed)
    t = 0.04 * np.arange(frames)
    begun = rng.integers(2, frames - 22)
    slip = (np.arange(frames) >= begun) & (np.arange(frames) < begun + 25)
    speed = np.where(slip, rng.uniform(0.01, 0.06), 0.0)
    signals = np.abs(1e-4 * rng.standard_normal((frames, len(SIGNALS)))).astype(np.float32)
    for signal in ("v_net", "mean_speed", "residual_along", "residual_excess", "rigid_speed"):
        signals[:, SIGNALS.index(signal)] += (0.02 * speed * rng.lognormal(0, 0.4, frames)).astype(np.float32)
    signals[:, SIGNALS.index("area")] = 0.2
    signals[:, SIGNALS.index("dt")] = 0.04
    signals[0, SIGNALS.index("v_net")] = np.nan
    labels = {
        "slip": slip,
        "speed": speed,
        "velocity_x": np.zeros(frames),
        "velocity_y": speed,
        "angular_velocity_label": np.zeros(frames),
    }
    return from_rows(name, object_name, protocol, t, signals, labels)


def dataset(objects=("a", "b", "c", "d", "e", "f"), recordings=3, seed=0):
    parts = [
        recording(f"{name}{number}", name, 1000 * seed + 100 * index + number)
        for index, name in enumerate(objects)
        for number in range(recordings)
    ]
    return joined(parts, {"figures_are": "simulated", "job": "detection"})
