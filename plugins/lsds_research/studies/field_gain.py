"""The gain of the estimator `field`, measured on the simulated cell: `python -m lsds_research.studies.field_gain`.

Slides at several speeds, grips and seeds, the controller off; for each frame in which the object truly slips, the ratio
of true speed to the residual that the estimator measures. The gain is their median, its uncertainty their spread.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lsds.config import RigConfig, load_config
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig
from lsds.session.truth_log import TruthLog

#: Speeds of the lifts, m/s: those of the severity protocol.
SPEEDS_M_S = (0.008, 0.023, 0.038, 0.045, 0.067)
#: Apertures of the grips, m; chosen.
APERTURES_M = (0.0242, 0.0238, 0.0236)
#: Slower motion does not count as sliding (m/s).
SLIDING_M_S = 2e-3


@dataclass(frozen=True, slots=True)
class FieldGain:
    """Median ratio, standard deviation of its logarithm, number of frames; and the errors with that gain (m/s)."""

    gain: float
    log_std: float
    frames: int
    mae_m_s: float
    moving_mae_m_s: float
    zero_mae_m_s: float


def measure(seeds: range = range(100, 103)) -> FieldGain:
    """Return the gain over all slides. Figures are simulated."""
    samples = np.array(list(_samples(seeds)))
    unit_speed, truth = samples[:, 0], samples[:, 1]
    sliding = (truth > SLIDING_M_S) & (unit_speed > 0)
    ratio = np.log(truth[sliding] / unit_speed[sliding])
    gain = math.exp(float(np.median(ratio)))
    error = np.abs(gain * unit_speed - truth)
    return FieldGain(
        gain,
        float(ratio.std()),
        int(np.count_nonzero(sliding)),
        float(error.mean()),
        float(error[sliding].mean()),
        float(truth.mean()),
    )


def _samples(seeds: range) -> Iterator[tuple[float, float]]:
    """Yield (speed estimated with a gain of one, true speed) of every frame of lift and hold."""
    for seed in seeds:
        for speed in SPEEDS_M_S:
            for aperture in APERTURES_M:
                config = load_config(
                    None,
                    [
                        f"seed={seed}",
                        "controller.enabled=false",
                        "estimator.field.gain=1.0",
                        f"task.lift_speed_m_s={speed}",
                        f"task.grip_aperture_m={aperture}",
                        "task.settle_s=0.2",
                        "task.lift_s=1.2",
                        "task.hold_s=0.3",
                    ],
                )
                yield from _pairs(config)


def _pairs(config: RigConfig) -> Iterator[tuple[float, float]]:
    with Rig(config) as rig:
        rig.arm_devices()
        rate_hz = config.schedule.arm_rate_hz
        truths = TruthLog(rig.own_cell, rate_hz)
        engine = Engine(rig)
        engine.every("truth", truths.sample, rate_hz)
        for cycle in engine:
            truth = truths.at(cycle.frame.t_ns)
            if cycle.acting and truth is not None and not cycle.estimate.abstained:
                yield cycle.estimate.speed_m_s, math.hypot(*truth.slip_velocity_m_s)


if __name__ == "__main__":
    found = measure()
    print(f"gain {found.gain:.1f}, log std {found.log_std:.2f}, over {found.frames} sliding frames (simulated)")
    print(
        f"MAE {100 * found.mae_m_s:.2f} cm/s, moving {100 * found.moving_mae_m_s:.2f}, "
        f"always zero {100 * found.zero_mae_m_s:.2f}"
    )
