"""The record of a run for its summary and picture: a few numbers per frame, and the images of two frames.

Keeping every image would let the memory of a long run grow without bound, and would slow down the loop, because image
memory could not be reused.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lsds.contracts.grip import PROBABLY

if TYPE_CHECKING:
    from lsds.contracts import Cycle
    from lsds.session.truth_log import TruthLog


@dataclass(frozen=True, slots=True)
class Sample:
    """One frame in numbers: SI units, NaN where unknown. `slip` is the detector's result, None if it abstained.

    `acting`: slip was corrected; `rising`: the arm was commanded upward. `seen_slip_m` is the height of the body
    "gripper" above the body "object", measured by a pose source. `load_n`, `limit_n` and its standard deviation are
    of a finger, `slip_probability` is that of the grip's belief.
    """

    t_ns: int
    stage: str
    acting: bool
    rising: bool
    kept_fraction: float
    contact_fraction: float
    slip: bool | None
    speed_m_s: float
    speed_std_m_s: float
    true_speed_m_s: float
    command_m: float | None
    held_m: float
    measured_m: float
    seen_slip_m: float = math.nan
    load_n: float = math.nan
    limit_n: float = math.nan
    limit_std_n: float = math.nan
    slip_probability: float = math.nan

    @property
    def called_slip(self) -> bool | None:
        """Whether the belief calls the frame slip; the detector's answer if nothing is believed."""
        return self.slip if math.isnan(self.slip_probability) else self.slip_probability > PROBABLY


class RunRecord:
    """An observer of the engine. `first` is the first frame in which slip is corrected, `worst` that of the fastest
    slip.

    `truths` has the true states of a simulated cell.
    """

    def __init__(self, truths: TruthLog | None = None) -> None:
        self._truths = truths
        self.samples: list[Sample] = []
        self.first: Cycle | None = None
        self.worst: Cycle | None = None
        self._worst_speed = -math.inf

    def observe(self, cycle: Cycle) -> None:
        """Add one cycle."""
        truth = None if self._truths is None else self._truths.at(cycle.frame.t_ns)
        estimate = cycle.estimate
        true_speed = math.nan if truth is None else math.hypot(*truth.slip_velocity_m_s)
        contact, grip = cycle.observation.contact, cycle.grip
        sample = Sample(
            cycle.t_ns,
            cycle.stage,
            cycle.acting,
            cycle.twist is not None and cycle.twist.linear_m_s[2] > 0,
            float(cycle.tracks.valid.mean()),
            math.nan if contact is None or not cycle.leads else contact.area_fraction,
            cycle.detection.slip,
            math.nan if estimate.abstained else estimate.speed_m_s,
            math.nan if estimate.abstained else estimate.speed_std_m_s,
            true_speed,
            cycle.command_m,
            cycle.held_m,
            cycle.measured_m,
            _seen_slip_m(cycle),
            grip.load_n,
            grip.limit_n,
            grip.limit_std_n,
            grip.slips,
        )
        self.samples.append(sample)
        # Pictures are of the first finger, and so are contact areas that are compared.
        if not (sample.acting and cycle.leads):
            return
        if self.first is None:
            self.first = cycle
        severity = sample.speed_m_s if math.isnan(true_speed) else true_speed
        if severity > self._worst_speed:
            self.worst, self._worst_speed = cycle, severity


def _seen_slip_m(cycle: Cycle) -> float:
    poses = {} if cycle.pose is None else cycle.pose.poses
    if "gripper" not in poses or "object" not in poses:
        return math.nan
    return poses["gripper"].position_m[2] - poses["object"].position_m[2]
