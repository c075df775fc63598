"""Controller `belief`: the least squeeze at which the load exceeds the friction limit with an accepted risk.

The belief (`lsds.grip.belief`) holds the load, the friction limit, and whether the object sticks or slides. The law
closes at once, opens slowly and only when certain, and never on an abstention, a failure, or while the load is gone.
"""

from __future__ import annotations

import math

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext, GripInput
from lsds.grip.observer import GripObserver

LATENCY_S = 0.11
MOST = 2.5


class BeliefOptions(BaseModel):
    """Options of `[controller.belief]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    margin: float = Field(default=1.2, ge=1, le=5, description="load that the grip is to carry over that expected")
    risk: float = Field(default=0.25, gt=0, lt=1, description="accepted probability that this load exceeds the limit")
    growth: float = Field(default=1.55, gt=1, le=3, description="greatest growth of the squeeze over the measured one")
    accepted_m: float = Field(default=6e-3, gt=0, le=0.1, description="slip after which the growth doubles")
    quiet_s: float = Field(default=0.3, ge=0, le=60, description="time of certainty before the fingers open")
    release_m_s: float = Field(default=0.004, ge=0, le=0.05, description="greatest opening speed; 0: never open")


class BeliefController:
    """A `Controller` that decides by one belief."""

    def __init__(self, options: BeliefOptions, context: BuildContext) -> None:
        self._options = options
        self.observer = GripObserver()
        self.reset()

    @property
    def may_open(self) -> bool:
        """True if it may open the fingers after a slip."""
        return self._options.release_m_s > 0

    def reset(self) -> None:
        """Forget the object."""
        self.observer.reset()
        self._quiet_s, self._opened_to = 0.0, None
        self._slid_n = self._slid_m = 0.0
        self._taken_ns = -1

    def update(self, state: GripInput) -> float | None:
        """Return the new aperture in metres, or None to leave the gripper unchanged."""
        aperture = state.frame_aperture_m if math.isfinite(state.frame_aperture_m) else state.measured_aperture_m
        grip = self.observer.update(
            state.t_ns, state.dt_s, aperture, state.touch_m, state.fingers, state.detection, state.estimate, state.stands
        )
        self.grip = grip
        if grip is None or grip.t_ns == self._taken_ns or not math.isfinite(state.aperture_m):
            return None
        dt_s = (grip.t_ns - self._taken_ns) * 1e-9 if self._taken_ns >= 0 else 0.0
        self._taken_ns = grip.t_ns
        if not grip.load_n > 0.03:
            return None
        belief, options = self.observer.belief, self._options
        self._slid_m += grip.slips * grip.speed_m_s * dt_s
        if grip.slips < 0.1:
            self._slid_m *= math.exp(-dt_s / 0.5)
        if grip.slips > 0.5:
            self._slid_n = grip.load_n
        ahead_n = grip.load_n + min(max(grip.load_n_s, 0.0) * LATENCY_S, grip.load_n)
        wanted_m = 1e-3 * belief.squeeze_mm(options.risk, options.margin, ahead_n)
        held_m = grip.touch_m - state.aperture_m
        tick_m = max(state.resolution_m, 1e-4)
        if wanted_m > held_m + tick_m / 2:
            self._quiet_s, self._opened_to = 0.0, None
            if held_m - grip.squeeze_m > tick_m:
                # What has been sent and has not arrived is not added to.
                return None
            growth = min(1 + (options.growth - 1) * (1 + self._slid_m / options.accepted_m), MOST)
            target_m = min(wanted_m, max(grip.squeeze_m * growth, grip.squeeze_m + tick_m))
            return max(0.0, grip.touch_m - target_m) if target_m > held_m else None
        return self._opened(state, held_m, tick_m, dt_s)

    def _opened(self, state: GripInput, held_m: float, tick_m: float, dt_s: float) -> float | None:
        observer, options = self.observer, self._options
        load = observer.load
        certain_m = 1e-3 * observer.belief.squeeze_mm(0.05, options.margin, max(load.greatest_n, 1e-3))
        if not (certain_m < held_m and state.detection.slip is False) or load.stale:
            self._quiet_s, self._opened_to = 0.0, None
            return None
        self._quiet_s += dt_s
        if self._quiet_s < options.quiet_s or load.now_n < 0.5 * self._slid_n or not self._slid_n:
            return None
        base = state.aperture_m if self._opened_to is None else self._opened_to
        farthest = state.aperture_m + max(tick_m, 3e-4)
        self._opened_to = min(base + options.release_m_s * dt_s, state.aperture_m + held_m - certain_m, farthest)
        return self._opened_to if self._opened_to > state.aperture_m else None
