"""Controller `belief`: the least squeeze at which the load exceeds the friction limit with an accepted risk.

The engine's belief (`lsds.grip.belief`) holds the load, the friction limit, and whether the object sticks or slides.
The law closes at once and opens slowly, only when the belief is certain. It never opens on an abstention, on a failure,
or while the load is gone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import nanoseconds
from lsds.contracts import BuildContext, GripEstimate, GripTask
from lsds.contracts.grip import MAYBE
from lsds.grip.belief import STEADY_1_S
from lsds.grip.fragile import Bearing
from lsds.grip.observer import GRAVITY_M_S2
from lsds.grip.wanted_slip import WantedSlip
from lsds.safety.guard import correction_opens_m
from lsds.tactile.carried_load import LEAST_EVIDENCE_N

SURELY = 0.75
"""Probability of a slide above which the object has slid, and the fingers close even if no load is known; chosen."""
MOST_RISK = 0.35
"""Maximum accepted risk, however slow a slide would be; chosen."""
RELEASED = 0.5
"""Share of the load that slipped below which the object may stand on a support, so the fingers do not open; chosen."""
LEAST_TICK_M = 1e-4
"""Resolution that is assumed of a gripper that declares a finer one, m; chosen."""
ARRIVES = 2.5
"""Multiple of the fingers' answer time after which a closing that has not arrived no longer delays the next; chosen."""
LOST_M = 4e-4
"""Distance, m, that fingers must rest wider than a command and two ticks before the command counts as lost and is sent
again; chosen."""
GIVES_WAY = 0.9
"""Share of the recent maximum load below which the load has slipped while the arm rests for probing; chosen."""
LEAST_PROBED_M = 4.5e-4
"""Minimum squeeze to which probing opens, m; a looser grip is not known to touch; chosen."""


FULL_REACH_M = 0.012
"""Half-length of the contact along the load from which on `slip_m` is accepted in full, m. Of 40 slippery spheres of
development draws 27 were held if all contacts accepted it in full, 27 from 6 mm on, 32 from 12 mm and from 24 mm on."""
LEAST_SLIP_M = 1e-3
"""Minimum accepted slip, however small the contact, m; chosen as the way of the take-up during one answer time."""


class BeliefOptions(BaseModel):
    """Options of `[controller.belief]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    margin: float = Field(default=1.08, ge=1, le=5, description="load that the grip is to carry, over the expected one")
    slip_m_s: float = Field(
        default=0.01,
        gt=0,
        le=0.1,
        description="accepted slip speed; over the speed of a slide, the accepted probability of one",
    )
    certain: float = Field(default=0.07, gt=0, lt=1, description="accepted probability of a slide after an opening")
    growth: float = Field(default=2.0, gt=1, le=3, description="greatest growth of the squeeze in one step")
    slip_m: float = Field(
        default=0.006,
        gt=0,
        le=0.1,
        description="accepted slip while the squeeze grows e-fold; less on a short contact",
    )
    quiet_s: float = Field(default=0.3, ge=0, le=60, description="time of certainty before the fingers open")
    release_m_s: float = Field(default=0.004, ge=0, le=0.05, description="greatest opening speed; 0: never open")


class _Quiet(NamedTuple):
    """A time of certainty (s), and the aperture to which it has opened, m, None if it has not opened yet."""

    s: float = 0.0
    opened_to_m: float | None = None


_NOT_QUIET = _Quiet()


class BeliefController:
    """A `Controller` that decides by one belief."""

    limits_force = True
    """It squeezes no more than `task.fragile_n` allows."""

    def __init__(self, options: BeliefOptions, context: BuildContext) -> None:
        self._options = options
        self.reset()

    @property
    def may_open(self) -> bool:
        """True if it may open the fingers after a slip."""
        return self._options.release_m_s > 0

    def reset(self) -> None:
        """Forget the object."""
        self.held_back = False
        self._quiet = _NOT_QUIET
        self._slid_n = 0.0
        self._found = False
        self._closed_n, self._began_at_m = 0.0, math.inf
        self._taken_ns: int | None = None
        self._closed_ns = 0
        self._touch_m, self._unmeasured_m = math.nan, math.inf
        self._bearing, self._wanted_slip = Bearing(), WantedSlip()

    def update(self, grip: GripEstimate, wanted: GripTask) -> float | None:
        """Return the new aperture in metres, or None to leave the gripper unchanged."""
        self.held_back = False
        options = self._options
        if not grip.complete or grip.t_ns == self._taken_ns or not math.isfinite(grip.touch_m - grip.commanded_m):
            return None
        if grip.touch_m != self._touch_m:
            # The squeeze counts from another touch, and so does what the object withstands.
            self._touch_m, self._bearing = grip.touch_m, Bearing()
        self._bearing.take(grip.squeeze_m, grip.normal_n)
        dt_s = 0.0 if self._taken_ns is None else min(max((grip.t_ns - self._taken_ns) * 1e-9, 0.0), wanted.answer_s)
        self._taken_ns = grip.t_ns
        # A time of certainty ends with a round in which nothing is opened, for whatever reason.
        quiet = _Quiet(self._quiet.s + dt_s, self._quiet.opened_to_m)
        self._quiet = _NOT_QUIET
        held_m, tick_m = grip.touch_m - grip.commanded_m, max(wanted.resolution_m, LEAST_TICK_M)
        if wanted.slide is not None:
            falls = self._wanted_slip.falls(grip.t_ns, grip.estimate, wanted.slide)
            return self._closed(grip, wanted, math.inf, held_m, tick_m) if falls else None
        carries = grip.load_n > LEAST_EVIDENCE_N
        if carries and grip.slips > SURELY:
            self._slid_n = grip.load_n
            self._found |= wanted.probes
        if wanted.probes and not self._found and grip.load_n < GIVES_WAY * grip.greatest_n:
            self._found = True
            least_m = max(options.margin * grip.squeeze_m, held_m + tick_m)
            return self._closed(grip, wanted, least_m, held_m, tick_m)
        # Where no load is measured no closing can refute an alarm: all of them together grow the grip at most once.
        self._unmeasured_m = math.inf if carries and not grip.stale else min(self._unmeasured_m, grip.squeeze_m)
        if not carries:
            most_m = options.growth * self._unmeasured_m
            return self._closed(grip, wanted, most_m, held_m, tick_m) if grip.slips > SURELY else None
        ahead_n = grip.load_n + min(max(grip.load_n_s, 0.0) * wanted.answer_s, grip.load_n)
        risk = self._risk(grip)
        # A sliding object must also stop within the accepted slip: kinetic energy over weight and distance.
        braking = 1.0
        if math.isfinite(grip.slip_m_s):
            braking += grip.slip_m_s**2 / (2 * GRAVITY_M_S2 * self._slip_m(grip))
        wanted_m = grip.required_m(risk, options.margin, ahead_n, braking)
        if not wanted.probes:
            wanted_m = max(wanted_m, grip.rising_m)
        late = grip.t_ns - self._closed_ns > nanoseconds(ARRIVES * wanted.answer_s)
        # Fingers that have not followed the last closing get it again, and no wider step.
        if late and held_m - grip.squeeze_m > LOST_M + 2 * tick_m:
            self._closed_ns = grip.t_ns
            return grip.commanded_m
        if wanted_m > held_m + tick_m / 2:
            return self._closed(grip, wanted, wanted_m, held_m, tick_m)
        return self._opened(grip, wanted, held_m, tick_m, dt_s, quiet)

    def _risk(self, grip: GripEstimate) -> float:
        """Return the accepted probability of a slide: less of a faster one."""
        return min(self._options.slip_m_s / grip.slip_m_s, MOST_RISK) if grip.slip_m_s > 0 else MOST_RISK

    def _slip_m(self, grip: GripEstimate) -> float:
        """Return the accepted slip: a round object that slips by the reach of its contact is squeezed out."""
        share = min(grip.reach_m / FULL_REACH_M, 1.0) if math.isfinite(grip.reach_m) else 1.0
        return max(share * self._options.slip_m, LEAST_SLIP_M)

    def _is_blind(self, grip: GripEstimate) -> bool:
        """Return whether something is missing without which it does not open."""
        unseen = any(finger.observation.load is None or finger.detection.slip is None for finger in grip.fingers)
        return unseen or grip.stale or math.isnan(grip.dt_s) or not self.may_open

    def _closed(
        self, grip: GripEstimate, wanted: GripTask, wanted_m: float, held_m: float, tick_m: float
    ) -> float | None:
        """Close towards a squeeze; on a slide by one step, which has to arrive before the next."""
        # Below the accepted risk the known load of what sticks decides; above it, the unknown one of what slides. It
        # decides, too, if a wanted slide becomes a fall.
        slides = grip.slips > self._risk(grip) or wanted_m == math.inf
        under_way = held_m - grip.squeeze_m > tick_m / 2
        if slides and under_way and grip.t_ns - self._closed_ns < nanoseconds(ARRIVES * wanted.answer_s):
            return None
        base_m = grip.squeeze_m if slides and not under_way else max(grip.squeeze_m, held_m)
        grows = min(grip.slip_m_s * wanted.answer_s / self._slip_m(grip), math.log(self._options.growth))
        target_m = min(wanted_m, max(base_m * math.exp(grows), base_m + tick_m))
        # The gripper rounds to its ticks, by up to half of one.
        allowed_m = self._bearing.allowed_m(wanted.fragile_n, grip.squeeze_m) - tick_m / 2
        self.held_back = target_m > allowed_m
        target_m = min(target_m, allowed_m)
        if not target_m > held_m:
            return None
        self._closed_ns = grip.t_ns
        if not self._closed_n:
            self._began_at_m = grip.commanded_m
        if wanted_m <= grip.rising_m:
            # A load that has risen was not carried by the grip of before.
            self._began_at_m = grip.touch_m - target_m
        self._closed_n = max(self._closed_n, grip.load_n) if grip.load_n > LEAST_EVIDENCE_N else self._closed_n
        return max(0.0, grip.touch_m - target_m)

    def _opened(
        self, grip: GripEstimate, wanted: GripTask, held_m: float, tick_m: float, dt_s: float, quiet: _Quiet
    ) -> float | None:
        """Open slowly to a grip that is certain to hold; while the job probes, until the object begins to slide."""
        options = self._options
        probes = wanted.probes and not self._found
        if probes:
            least_m = LEAST_PROBED_M
            sure = abs(grip.load_n_s) < STEADY_1_S * grip.load_n and grip.slips <= MAYBE
        else:
            least_m = grip.required_m(options.certain, options.margin, max(grip.greatest_n, LEAST_EVIDENCE_N), 1.0)
            # Without a slip the fingers reopen at most to where they began to close, or a rising load has closed them.
            least_m = least_m if self._slid_n else max(least_m, grip.touch_m - self._began_at_m)
            sure = grip.load_n > RELEASED * (self._slid_n or self._closed_n or math.inf) and not wanted.probes
        if not (sure and least_m < held_m and grip.detection.slip is False) or self._is_blind(grip):
            return None
        self._quiet = quiet
        if quiet.s < options.quiet_s:
            return None
        # The gripper rounds to its ticks, so openings are added up until they reach the next one. The guard would
        # clamp what is beyond its limit, so they are not added up farther.
        base_m = grip.commanded_m if quiet.opened_to_m is None else quiet.opened_to_m
        farthest_m = grip.commanded_m + correction_opens_m(tick_m)
        opened_to_m = min(base_m + options.release_m_s * dt_s, grip.touch_m - least_m, farthest_m)
        self._quiet = quiet._replace(opened_to_m=opened_to_m)
        return opened_to_m if opened_to_m - grip.commanded_m > tick_m / 2 else None
