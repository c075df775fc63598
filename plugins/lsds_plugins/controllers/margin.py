"""Controller `margin`: the squeeze that carries the load with a margin, and no more.

    quiet    squeeze = margin x load / limit, closing at once, opening slowly; where the limit is not known, what held
             the load while it was steady, in proportion to a load that has grown since
    slip     squeeze = what was seen slipping x (1 + growth v / (v + v0)), v being the slip speed; or, where the load
             has fallen while it slips, x margin x load before / load now: that is what is missing

Squeeze is the aperture at touch less the aperture at the time of the frame: a frame shows what was, and what is under
way since must not be added again. When slip has ended, the fingers open slowly to the margin and stop there. They never
open on an abstention, on a doubt, on a failure, or while the load is gone. A slip that the job wants is not caught.
"""

from __future__ import annotations

import math

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import nanoseconds
from lsds.contracts import BuildContext, GripInput
from lsds.grip.carried import LEAST_N, CarriedLoad
from lsds.grip.fragile import Bearing
from lsds.grip.limit import FrictionLimit
from lsds.grip.rounds import Rounds
from lsds.grip.soft_finger import speed_of
from lsds.grip.sure_slip import SureSlip
from lsds.grip.wanted_slip import WantedSlip

SLOW_M_S = 0.01
"""Slip speed at which half of the growth is asked for."""
UNTOLD_M = 1.5e-3
"""Squeeze that is taken where the job did not tell the aperture at touch."""
LEAST_M = 1e-4
"""A smaller squeeze is not known well enough to divide by."""
FALLEN = 0.85
"""A load below this share of the greatest of late has fallen: what was held before does not refute an alarm."""
GIVES_WAY = 0.9
"""While probing, a load below this share of the greatest of late has slipped: the arm is at rest."""
LIGHT = 0.5
"""With less than this share of the load that slipped, the object stands on something or hangs otherwise: no reason to
open."""
PATIENCE_S = 0.18
"""Alarms that go on for longer are not refuted."""
PERSISTS = 2.5
"""Least growth of the squeeze for every second that a slip goes on: a fast one looks slow to a camera."""
SHOVED, MOST_SHOVED = 1.6, 2.0
"""Least growth of the squeeze on a slip under a load that has jumped: that is a fast one; and how far what jumps is
followed ahead of time, over the squeeze before."""
BRAKES, MOST_LOST = 1.3, 2.5
"""Where the load has fallen the object falls: more than what carries it is needed to stop it; and the greatest growth
of the squeeze as long as nothing else tells that something slips."""
REBOUND_S = 0.3
"""After a jump a load may fall for so long because what was caught springs back."""
MOST = 3.0
"""Greatest growth of the squeeze in one frame on a slip."""
FOLLOWED = 1.5
"""Greatest growth of the squeeze in one frame where it follows the load."""
GROWN, MOST_GROWN = 1.1, 2.5
"""A load that has grown by this factor since it was steady is followed, before anything has slipped; and how far."""
COARSE = 0.08
"""Half a tick that is a greater share of the squeeze is coarse."""
STEADY_N = 0.1
"""A smaller load may be the gel's creep, before the object is lifted: what holds it tells nothing."""
LOST_M = 4e-4
"""Fingers that rest wider than this beyond the last command have not received it."""
LEAST_PROBED_M = 4.5e-4
"""Probing opens so far at most: what is held by less is not known to touch."""
LEAST_TICK_M = 3e-4
"""Openings add up to this, or to the gripper's tick, before the next has to be carried out."""
STILL_M = 2e-6
"""An opening by less in a frame is none."""
OPENING_S = 0.4
"""Time in which the fingers open by two thirds of what is too much."""


class MarginOptions(BaseModel):
    """Options of `[controller.margin]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    margin: float = Field(default=1.2, ge=1, le=5, description="squeeze over what the load needs")
    growth: float = Field(default=0.8, gt=0, le=10, description="growth of the squeeze at a fast slip")
    quiet_s: float = Field(default=0.3, ge=0, le=60, description="time without slip before the fingers open")
    release_m_s: float = Field(default=0.006, ge=0, le=0.05, description="greatest opening speed; 0: never open")
    probe_m_s: float = Field(default=0.003, gt=0, le=0.01, description="opening speed where task.probe lets it probe")


class MarginController:
    """A `Controller` that knows load, squeeze and the friction limit."""

    def __init__(self, options: MarginOptions, context: BuildContext) -> None:
        self._options = options
        self.reset()

    minds_force = True
    """It squeezes no more than `task.fragile_n` allows."""

    @property
    def may_open(self) -> bool:
        """True if it may open the fingers after a slip."""
        return self._options.release_m_s > 0

    def reset(self) -> None:
        """Forget the object: load, limit and touch."""
        self._limit = FrictionLimit()
        self._load = CarriedLoad()
        self._touch_m = math.nan
        self._quiet_s = 0.0
        self._rounds, self._round_s = Rounds(), 0.0
        self._sure = SureSlip()
        self._bearing = Bearing()
        self._alarmed_ns: int | None = None
        self._jumped_ns = -nanoseconds(REBOUND_S)
        self._slipped_n = 0.0
        self._steady_ratio = self._steady_m = math.nan
        self._probed_m = self._calm_m = 0.0
        self._allowed_m = math.inf
        self.held_back = False
        self._opened_to: float | None = None
        self._back_m: float | None = None
        self._wanted_slip = WantedSlip()

    def update(self, state: GripInput) -> float | None:
        """Return the new aperture in metres, or None to leave the gripper unchanged."""
        self.held_back = False
        aperture = state.frame_aperture_m if math.isfinite(state.frame_aperture_m) else state.measured_aperture_m
        if not (math.isfinite(aperture) and math.isfinite(state.aperture_m)):
            return None
        load = self._load
        load.take(state.t_ns, state.fingers)
        self._touch_m = self._touched_at(state, aperture)
        squeeze_m = max(self._touch_m - aperture, LEAST_M)
        if load.jumped_n > 0:
            self._jumped_ns = state.t_ns
        elif not load.fell:
            self._calm_m = squeeze_m
        commanded_m = self._touch_m - state.aperture_m
        self._allowed_m = self._bearing.allowed_m(
            state.fragile_n, squeeze_m, load.normal_n, self._limit.limit, commanded_m
        )
        if state.slide is not None:
            self._alarmed_ns = None
            # The fingers neither open nor follow the load: it is that of the arm, which pushes.
            falls = self._wanted_slip.falls(state.t_ns, state.estimate, state.slide)
            return self._caught(state, squeeze_m, 1.0) if falls else None
        sure = self._sure.see(state.t_ns, state.estimate, state.fingers)
        slips = True if sure else state.detection.slip
        if slips is None:
            self._alarmed_ns = None
            return None
        if not math.isfinite(load.now_n):
            return self._caught(state, squeeze_m, 1.0) if slips else None
        if state.probes and self._gives_way():
            # It held at the last tick, and does not at this one; the next tick is added where ticks are coarse.
            self._limit.slips(load.greatest_n / squeeze_m, sure=True)
            self._slipped_n, self._quiet_s, self._opened_to = load.greatest_n, 0.0, None
            return self._closed(state, squeeze_m * self._options.margin, slips=True)
        ratio = load.now_n / squeeze_m
        refuted = slips and self._is_refuted(state, ratio)
        springs_back = state.t_ns - self._jumped_ns < nanoseconds(REBOUND_S)
        if slips and not refuted:
            if load.now_n > LEAST_N:
                self._learn_slip(state, ratio, sure=sure or load.jumped_n > 0)
                self._slipped_n = load.greatest_n
            fallen = load.now_n < FALLEN * load.greatest_n and not springs_back
            return self._caught(state, squeeze_m, load.greatest_n / max(load.now_n, LEAST_N) if fallen else 1.0)
        if load.fell and not springs_back and not slips:
            return self._lost(state, squeeze_m)
        if not slips:
            self._alarmed_ns = None
            self._quiet_s += max(state.dt_s, 0.0) if math.isfinite(state.dt_s) else 0.0
        self._round_s += state.dt_s if state.dt_s > 0 else 0.0
        if self._rounds.completes(state.fingers):
            self._limit.holds(ratio, self._round_s)
            self._round_s = 0.0
        self._note_steady(squeeze_m)
        return self._followed(state, squeeze_m, doubted=bool(slips))

    def _learn_slip(self, state: GripInput, ratio: float, *, sure: bool) -> None:
        """Take a slip into the limit; that a second frame confirms it counts only where every finger has seen one."""
        if not self._limit.slipping:
            self._rounds.restart(state.fingers)
        elif not sure and not self._rounds.completes(state.fingers):
            return
        self._limit.slips(ratio, sure=sure)

    def _is_refuted(self, state: GripInput, ratio: float) -> bool:
        """Tell whether an alarm contradicts what was held, while the load is what it was."""
        self._alarmed_ns = state.t_ns if self._alarmed_ns is None else self._alarmed_ns
        if state.t_ns - self._alarmed_ns > nanoseconds(PATIENCE_S) or self._load.jumped_n > 0:
            return False
        carried = self._load.now_n > FALLEN * self._load.greatest_n
        return carried and self._limit.refutes(ratio)

    def _caught(self, state: GripInput, squeeze_m: float, missing: float) -> float | None:
        """Close on a slip; `missing` is the load to be carried over what friction carries now."""
        self._quiet_s, self._opened_to = 0.0, None
        self._steady_ratio = math.nan
        self._sure.forget()
        self._back_m = None
        speed, _ = speed_of(state.estimate)
        if state.estimate.abstained or not math.isfinite(speed):
            speed = 0.0
        # Before anything pulls, alarms that go on are noise.
        since_s = 0.0
        if self._alarmed_ns is not None and self._load.now_n > LEAST_N:
            since_s = (state.t_ns - self._alarmed_ns) * 1e-9
        growth = 1 + max(self._options.growth * speed / (speed + SLOW_M_S), PERSISTS * since_s)
        if self._load.jumped_n > 0:
            growth = max(growth, min(SHOVED, MOST_SHOVED * self._calm_m / squeeze_m))
        if missing > 1:
            growth = max(growth, self._options.margin * missing)
        growth = min(growth, MOST)
        return self._closed(state, squeeze_m * growth, slips=True)

    def _lost(self, state: GripInput, squeeze_m: float) -> float | None:
        """Close on a load that has just fallen, before a detector can tell why; where nothing slips, open again."""
        self._quiet_s, self._opened_to = 0.0, None
        self._back_m = self._calm_m if self._back_m is None else self._back_m
        wanted_m = BRAKES * self._options.margin * squeeze_m * self._load.greatest_n / self._load.now_n
        return self._closed(state, min(wanted_m, MOST_LOST * self._calm_m), slips=True)

    def _followed(self, state: GripInput, squeeze_m: float, *, doubted: bool) -> float | None:
        """Follow the load: close at once, open slowly when it has been quiet for long enough."""
        load = self._load
        wanted_m = self._limit.squeeze_m(load.greatest_n, self._options.margin)
        if load.jumped_n > 0 and self._limit.known:
            ahead_m = self._limit.squeeze_m(load.jumped_n, self._options.margin)
            wanted_m = max(wanted_m, min(ahead_m, MOST_SHOVED * self._calm_m))
        if not math.isfinite(wanted_m):
            if state.probes:
                return None if doubted else self._probed(state, squeeze_m)
            return self._held(state, squeeze_m, doubted=doubted)
        wanted_m = min(wanted_m, FOLLOWED * squeeze_m) if wanted_m > squeeze_m else wanted_m
        wanted = self._aperture_m(state, wanted_m)
        if not wanted > state.aperture_m:
            self._opened_to = None
            return self._closed(state, wanted_m, slips=False)
        # Found while probing, the object stands on its support, which carries a part of it.
        doubted |= state.probes or load.stale or load.greatest_n < LIGHT * self._slipped_n
        return None if doubted else self._opened(state, wanted, self._options.release_m_s)

    def _held(self, state: GripInput, squeeze_m: float, *, doubted: bool) -> float | None:
        """Follow a load that has grown where no limit is known; after a jump go back to what held before it."""
        load = self._load
        wanted_m = self._grown_m(squeeze_m)
        if load.jumped_n > 0 and math.isfinite(self._steady_ratio):
            wanted_m = max(wanted_m, min(load.jumped_n / self._steady_ratio, MOST_SHOVED * self._calm_m))
            self._back_m = self._calm_m if self._back_m is None else self._back_m
        closed = self._closed(state, wanted_m, slips=False)
        if closed is not None or self._back_m is None or doubted or load.jumped_n > 0 or load.stale:
            self._opened_to = None
            return closed
        return self._opened(state, self._aperture_m(state, max(self._back_m, wanted_m)), self._options.release_m_s)

    def _gives_way(self) -> bool:
        """Tell whether the load of an object at rest has fallen while the fingers opened: it slides, or stands."""
        load = self._load
        return not self._limit.known and load.greatest_n > LEAST_N and load.now_n < GIVES_WAY * load.greatest_n

    def _probed(self, state: GripInput, squeeze_m: float) -> float | None:
        """Open carefully where the object hangs still and it is not known what holds it."""
        load = self._load
        if not (state.probes and load.steady and load.now_n > LEAST_N) or load.stale or not self.may_open:
            return None
        # What is opened on purpose is no load that has grown.
        self._steady_ratio = math.nan
        aperture = self._opened(state, self._touch_m - LEAST_PROBED_M, self._options.probe_m_s)
        if aperture is not None or self._probed_m:
            self._probed_m = squeeze_m
        return aperture

    def _opened(self, state: GripInput, wanted: float, most_m_s: float) -> float | None:
        """Return the next aperture on the way to a wider one, when it has been quiet for long enough."""
        if self._quiet_s < self._options.quiet_s or not state.dt_s > 0 or wanted <= state.aperture_m:
            return None
        # The device rounds steps smaller than a tick, so integrate what was asked for, not what was sent.
        base = state.aperture_m if self._opened_to is None else self._opened_to
        speed = min(most_m_s, (wanted - base) / OPENING_S)
        # Openings that were not carried out are not added up.
        farthest = state.aperture_m + max(state.resolution_m, LEAST_TICK_M)
        before, self._opened_to = self._opened_to, min(base + speed * state.dt_s, wanted, farthest)
        # An opening that is lost leaves the grip tighter, so it need not be said twice.
        return None if before is not None and self._opened_to - before < STILL_M else self._opened_to

    def _closed(self, state: GripInput, squeeze_m: float, *, slips: bool) -> float | None:
        """Return the aperture of a squeeze where that closes, or the last one again where it was not received."""
        aperture = self._aperture_m(state, squeeze_m)
        if aperture < state.aperture_m:
            return aperture
        behind = state.measured_aperture_m > state.aperture_m + max(LOST_M, 2 * state.resolution_m)
        return state.aperture_m if behind and (slips or self._quiet_s > self._options.quiet_s) else None

    def _aperture_m(self, state: GripInput, squeeze_m: float) -> float:
        """Return the aperture of a squeeze; what the object stands comes first.

        A device goes to its nearest tick. Where that could eat the margin, it is sent to the next one.
        """
        half_m = state.resolution_m / 2
        finer_m = half_m if half_m > COARSE * squeeze_m else 0.0
        self.held_back = squeeze_m > self._allowed_m
        return max(0.0, self._touch_m - min(squeeze_m + finer_m, self._allowed_m))

    def _note_steady(self, squeeze_m: float) -> None:
        """Remember what held while the load was steady: it is no limit, but it is known to hold."""
        load = self._load
        if not math.isfinite(self._steady_ratio) and load.steady and load.greatest_n > STEADY_N:
            self._steady_ratio, self._steady_m = load.greatest_n / squeeze_m, squeeze_m

    def _grown_m(self, squeeze_m: float) -> float:
        """Return the squeeze (m) in proportion to a load that has grown since it was steady, 0 before it was.

        What held at the end of probing gets its margin, too: a smooth object slips unseen.
        """
        wanted_m = self._options.margin * self._probed_m
        if math.isfinite(self._steady_ratio):
            grown_m = self._load.greatest_n / (GROWN * self._steady_ratio)
            wanted_m = max(wanted_m, min(grown_m, MOST_GROWN * self._steady_m))
        return min(wanted_m, FOLLOWED * squeeze_m)

    def _touched_at(self, state: GripInput, aperture_m: float) -> float:
        if math.isfinite(state.touch_m):
            return state.touch_m
        return self._touch_m if math.isfinite(self._touch_m) else aperture_m + UNTOLD_M
