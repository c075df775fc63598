"""The input of a controller: the estimate of the grip, and what is wanted of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lsds.contracts.brief import brief
from lsds.contracts.values import ABSTAINED, UNANSWERED, Detection, SlipEstimate

if TYPE_CHECKING:
    from lsds.contracts.finger import FingerCycle
    from lsds.contracts.values import Slide


def _unknown_m(risk: float, margin: float, load_n: float, braking: float) -> float:
    """Return the squeeze that an unknown grip requires: NaN."""
    return math.nan


PROBABLY = 0.5
"""Probability of a slide above which an object counts as sliding."""
MAYBE = 0.25
"""Probability of a slide up to which an object counts as held; chosen."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class GripEstimate:
    """The grip at the time of a frame. Metres, newtons and seconds; NaN where something is not known.

    Seen: `dt_s` is the measured time since the frame before, of the finger that came first; `detection` and `estimate`
    are fused over the fingers, and `fingers` holds the newest view of each. Where no finger could measure a motion,
    `estimate` is the last one, with a growing standard deviation, for `bridged` frames, at most three. `commanded_m` is
    the aperture last commanded, `measured_m` the newest that the gripper reported, `aperture_m` that at the time of the
    frame, and `touch_m` that at touch.

    Believed: `squeeze_m` is by how much the fingers are closed beyond touch. `load_n` is the load a finger, force
    and torque together; `load_n_s` its rate, `greatest_n` its maximum of late, and `stale` whether a finger does
    not show it now. `normal_n` is the normal force by the imprint, and `reach_m` the half-length of the contact
    along the load. `limit_n` is the friction limit of a finger at that squeeze, with its standard deviation
    `limit_std_n`. `slips` is the probability that the object slides, `slip_m_s` its speed if it does: that of the
    arm while the object may stand on its support, else at least that of a fall. `required_m(risk, margin, load_n,
    braking)` returns the least squeeze at which `margin` times the load exceeds the friction limit with at most
    that probability, for an object that sticks at no more than `load_n`, or slides at any load, which then counts
    `braking` times; it answers for the newest grip, not for that of `t_ns`. `rising_m` is the squeeze at which a
    load that rises in the air keeps the share of the friction limit that the grip has carried; 0 if the load does
    not rise.

    With several fingers the belief takes a frame of each at once: `complete` is true in the frame that completes a
    round, and what is believed is that of the last complete one otherwise.
    """

    __repr__ = brief

    t_ns: int = 0
    dt_s: float = math.nan
    detection: Detection = UNANSWERED
    estimate: SlipEstimate = ABSTAINED
    bridged: int = 0
    fingers: tuple[FingerCycle, ...] = ()
    commanded_m: float = math.nan
    measured_m: float = math.nan
    aperture_m: float = math.nan
    touch_m: float = math.nan
    squeeze_m: float = math.nan
    load_n: float = math.nan
    load_n_s: float = math.nan
    greatest_n: float = math.nan
    rising_m: float = 0.0
    stale: bool = True
    normal_n: float = math.nan
    reach_m: float = math.nan
    limit_n: float = math.nan
    limit_std_n: float = math.nan
    slips: float = math.nan
    slip_m_s: float = math.nan
    required_m: Callable[[float, float, float, float], float] = _unknown_m
    complete: bool = False

    @property
    def sliding(self) -> bool:
        """Whether the object probably slides: what figures, pictures and jobs call slip."""
        return self.slips > PROBABLY

    @property
    def may_slide(self) -> bool:
        """Whether the object does not count as held."""
        return self.slips > MAYBE


@dataclass(frozen=True, slots=True, kw_only=True)
class GripTask:
    """The requirements of job, task and devices on a grip.

    `probes`: the job lets the controller open on purpose, to find the least grip; `slide` is a slip that is wanted,
    None if none is. `fragile_n` is the greatest normal force a finger that the object stands. `resolution_m` is the
    gripper's; `answer_s` is the time from a change at the object to the fingers' answer, by the specs of sensor and
    gripper.
    """

    probes: bool = False
    slide: Slide | None = None
    fragile_n: float = math.inf
    resolution_m: float = 0.0
    answer_s: float = 0.1
