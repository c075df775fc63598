"""Controller `margin`: the squeeze that carries the load with a margin, and no more.

    quiet    squeeze = margin x load / limit, closing at once, opening slowly; unchanged where the limit is not known
    slip     squeeze = what was seen slipping x (1 + growth v / (v + v0)), v being the slip speed; or, where the load
             has fallen while it slips, x margin x load before / load now: that is what is missing

Squeeze is the aperture at touch less the aperture at the time of the frame: a frame shows what was, and what is under
way since must not be added again. When slip has ended, the fingers open slowly to the margin and stop there. They never
open on an abstention or on a failure.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import nanoseconds
from lsds.contracts import BuildContext, GripInput
from lsds.grip.limit import FrictionLimit

if TYPE_CHECKING:
    from lsds.contracts import ContactLoad

SLOW_M_S = 0.01
"""Slip speed at which half of the growth is asked for."""
SEEN_M_S, SURE = 0.005, 2.0
"""An estimate that is above this speed by so many standard deviations, in two frames in a row, is a slip, too: a smooth
slide does not tremble, and detectors may miss it."""
UNTOLD_M = 1.5e-3
"""Squeeze that is taken where the job did not tell the aperture at touch."""
LEAST_M = 1e-4
"""A smaller squeeze is not known well enough to divide by."""
LEAST_N = 1e-3
"""A smaller load is noise."""
REMEMBERED_S = 1.0
"""The load to be carried is the greatest of this time: an arm that brakes lightens it for a moment only."""
FALLEN = 0.85
"""A load below this share of the greatest of late has fallen: what was held before does not refute an alarm."""
PATIENCE = 5
"""So many alarms in a row are not refuted."""
MOST = 3.0
"""Greatest growth of the squeeze in one frame."""
STILL_M = 2e-6
"""An opening by less in a frame is none."""
OPENING_S = 0.4
"""Time in which the fingers open by two thirds of what is too much."""


class MarginOptions(BaseModel):
    """Options of `[controller.margin]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    margin: float = Field(default=1.25, ge=1, le=5, description="squeeze over what the load needs")
    growth: float = Field(default=0.8, gt=0, le=10, description="growth of the squeeze at a fast slip")
    quiet_s: float = Field(default=0.3, ge=0, le=60, description="time without slip before the fingers open")
    release_m_s: float = Field(default=0.006, ge=0, le=0.05, description="greatest opening speed; 0: never open")


class MarginController:
    """A `Controller` that knows load, squeeze and the friction limit."""

    def __init__(self, options: MarginOptions, context: BuildContext) -> None:
        self._options = options
        self.reset()

    @property
    def may_open(self) -> bool:
        """True if it may open the fingers after a slip."""
        return self._options.release_m_s > 0

    def reset(self) -> None:
        """Forget the object: load, limit and touch."""
        self._limit = FrictionLimit()
        self._zero: dict[str, ContactLoad] = {}
        self._loads: deque[tuple[int, float]] = deque()
        self._touch_m = math.nan
        self._quiet_s = 0.0
        self._suspected = False
        self._alarms = 0
        self._opened_to: float | None = None

    def update(self, state: GripInput) -> float | None:
        """Return the new aperture in metres, or None to leave the gripper unchanged."""
        load_n = self._load_n(state)
        aperture = state.frame_aperture_m if math.isfinite(state.frame_aperture_m) else state.measured_aperture_m
        if not (math.isfinite(load_n) and math.isfinite(aperture)):
            return None
        self._touch_m = self._touched_at(state, aperture)
        squeeze_m = max(self._touch_m - aperture, LEAST_M)
        ratio = load_n / squeeze_m
        slips = self._slips(state)
        greatest_n = self._greatest_n(state.t_ns, load_n)
        self._alarms = self._alarms + 1 if slips else 0
        carried = load_n > FALLEN * greatest_n and self._alarms <= PATIENCE
        if slips and carried and self._limit.refutes(ratio):
            slips = False
        if slips is None:
            return None
        if slips:
            self._limit.slips(ratio)
            missing = greatest_n / max(load_n, LEAST_N) if load_n < FALLEN * greatest_n else 1.0
            return self._caught(state, squeeze_m, missing)
        self._quiet_s += max(state.dt_s, 0.0) if math.isfinite(state.dt_s) else 0.0
        self._limit.holds(ratio, state.dt_s)
        return self._followed(state, greatest_n)

    def _slips(self, state: GripInput) -> bool | None:
        """Tell whether it slips: the detector says so, or the estimator is sure of a speed for the second time."""
        estimate = state.estimate
        seen = not estimate.abstained and estimate.speed_m_s - SURE * estimate.speed_std_m_s > SEEN_M_S
        twice, self._suspected = seen and self._suspected, seen
        return True if twice else state.detection.slip

    def _caught(self, state: GripInput, squeeze_m: float, missing: float) -> float | None:
        """Close on a slip; `missing` is the load to be carried over what friction carries now."""
        self._quiet_s, self._opened_to = 0.0, None
        speed = state.estimate.speed_m_s
        if state.estimate.abstained or not math.isfinite(speed):
            speed = 0.0
        growth = 1 + self._options.growth * speed / (speed + SLOW_M_S)
        if missing > 1:
            growth = max(growth, min(self._options.margin * missing, MOST))
        wanted_m = squeeze_m * growth
        aperture = max(0.0, self._touch_m - wanted_m)
        return aperture if aperture < state.aperture_m else None

    def _followed(self, state: GripInput, load_n: float) -> float | None:
        """Follow the load: close at once, open slowly when it has been quiet for long enough."""
        squeeze_m = self._limit.squeeze_m(load_n, self._options.margin)
        if not math.isfinite(squeeze_m):
            return None
        wanted = max(0.0, self._touch_m - squeeze_m)
        if wanted <= state.aperture_m:
            self._opened_to = None
            return wanted if wanted < state.aperture_m else None
        if self._quiet_s < self._options.quiet_s or not state.dt_s > 0:
            return None
        # The device rounds steps smaller than a tick, so integrate what was asked for, not what was sent.
        base = state.aperture_m if self._opened_to is None else self._opened_to
        speed = min(self._options.release_m_s, (wanted - base) / OPENING_S)
        before, self._opened_to = self._opened_to, min(base + speed * state.dt_s, wanted)
        # An opening that is lost leaves the grip tighter, so it need not be said twice.
        return None if before is not None and self._opened_to - before < STILL_M else self._opened_to

    def _load_n(self, state: GripInput) -> float:
        """Return the load of a finger (N), the mean over the fingers; NaN where none tells."""
        loads = []
        for finger in state.fingers:
            own = finger.observation.load
            if own is not None:
                loads.append(own.since(self._zero.setdefault(finger.finger, own)).force_n)
        return sum(loads) / len(loads) if loads else math.nan

    def _greatest_n(self, t_ns: int, load_n: float) -> float:
        """Return the greatest load (N) of late."""
        self._loads.append((t_ns, load_n))
        while t_ns - self._loads[0][0] > nanoseconds(REMEMBERED_S):
            self._loads.popleft()
        return max(load for _, load in self._loads)

    def _touched_at(self, state: GripInput, aperture_m: float) -> float:
        if math.isfinite(state.touch_m):
            return state.touch_m
        return self._touch_m if math.isfinite(self._touch_m) else aperture_m + UNTOLD_M
