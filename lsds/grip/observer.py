"""Estimates the grip: feeds the belief once per round of fingers with load, squeeze and evidence of slip."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.contracts.grip import GripEstimate
from lsds.grip.belief import GripBelief
from lsds.grip.carried import LEAST_N, CarriedLoad
from lsds.grip.evidence import SlipEvidence
from lsds.grip.rounds import Rounds
from lsds.grip.soft_finger import speed_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds.contracts import Detection, FingerCycle, SlipEstimate

UNTOLD_M = 1.5e-3
"""Squeeze that is assumed if the job does not know the aperture at touch."""
LEAST_M = 3e-4
"""A smaller squeeze is not known well enough to divide by."""
STEP_M = 1e-4
"""The squeeze has changed if it differs by more than this."""
FALLS_M_S = 0.04
"""Least speed of a slide in the air: an object of which friction carries nine tenths gains it in 40 ms."""
GRAVITY_M_S2 = 9.81
"""Acceleration of a falling object."""
LATENCY_S = 0.11
"""Time from a change of the load to the fingers' answer: camera, computing, a Hand-E and its way."""
ARM_LAG_S = 0.12
"""The arm may still move as fast as was wanted so long ago."""


class GripObserver:
    """Estimates the grip of one object."""

    def __init__(self) -> None:
        self.belief = GripBelief()
        self.reset()

    def reset(self) -> None:
        """Forget the object."""
        self.belief.reset()
        self.load, self._evidence = CarriedLoad(), SlipEvidence()
        self._rounds, self._round_s = Rounds(), 0.0
        self._speeds: deque[tuple[int, float]] = deque()
        self._touch_m = self._squeeze_m = self._before_n = math.nan
        self._changed_ns = -nanoseconds(1.0)
        self._estimate: GripEstimate | None = None

    def update(
        self,
        t_ns: int,
        dt_s: float,
        aperture_m: float,
        touch_m: float,
        fingers: Sequence[FingerCycle],
        detection: Detection,
        estimate: SlipEstimate,
        supported: bool = False,
        speed_m_s: float = math.inf,
    ) -> GripEstimate | None:
        """Take a frame; return what is known of the grip, None before the aperture is known.

        `aperture_m` is that at the time of the frame, `touch_m` that at touch, NaN if unknown; `speed_m_s` is the
        arm's, `supported` whether the object may still stand on its support.
        """
        self.load.take(t_ns, fingers)
        if not math.isfinite(aperture_m):
            return None
        if math.isfinite(touch_m):
            self._touch_m = touch_m
        elif not math.isfinite(self._touch_m):
            self._touch_m = aperture_m + UNTOLD_M
        squeeze_m = max(self._touch_m - aperture_m, LEAST_M)
        if not abs(squeeze_m - self._squeeze_m) < STEP_M:
            self._changed_ns, self._squeeze_m = t_ns, squeeze_m
        self._round_s += dt_s if dt_s > 0 else 0.0
        self._speeds.append((t_ns, speed_m_s))
        while self._speeds[0][0] < t_ns - nanoseconds(ARM_LAG_S):
            self._speeds.popleft()
        if not self._rounds.completes(fingers) and self._estimate is not None:
            return self._estimate
        round_s, self._round_s = self._round_s, 0.0
        load_n, rate = self.load.now_n, 0.0
        arm_m_s = max(speed for _, speed in self._speeds)
        evidence = self._evidence.take(detection, estimate, (t_ns - self._changed_ns) * 1e-9)
        if load_n > LEAST_N:
            if math.isfinite(self._before_n) and round_s > 0:
                rate = (load_n - self._before_n) / round_s
            self._before_n = load_n
            moved_mm = 1e3 * round_s * arm_m_s if round_s > 0 else 0.0
            stands = supported and not speed_m_s > 0
            self.belief.update(load_n, 1e3 * squeeze_m, round_s, evidence, stands, moved_mm)
        elif not math.isfinite(load_n):
            self.belief.weigh(evidence)
        self._estimate = GripEstimate(
            t_ns,
            self._touch_m,
            squeeze_m,
            load_n,
            rate,
            self.load.greatest_n,
            self.load.stale,
            self.load.normal_n,
            self.belief.slips,
            _slide_m_s(arm_m_s, estimate, supported, load_n, self.load.greatest_n),
            self._required_m,
            *(self.belief.limit_n(1e3 * squeeze_m) if load_n > LEAST_N else (math.nan, math.nan)),
        )
        return self._estimate

    def _required_m(self, risk: float, margin: float, load_n: float, braking: float) -> float:
        """Return the least squeeze (m) at which `margin` times the load exceeds the friction limit with this risk."""
        return 1e-3 * self.belief.squeeze_mm(risk, margin, load_n, braking)


def _slide_m_s(arm_m_s: float, estimate: SlipEstimate, supported: bool, load_n: float, carried_n: float) -> float:
    """Return how fast an object slides if it does: the arm draws the fingers along what stands; what hangs falls.

    Of what hangs, friction that carries only `load_n` of the `carried_n` leaves the rest to gravity until the fingers
    answer.
    """
    arm_m_s = arm_m_s if math.isfinite(arm_m_s) else FALLS_M_S
    if supported:
        return arm_m_s
    missing = 1 - load_n / carried_n if carried_n > LEAST_N else 0.0
    falls_m_s = GRAVITY_M_S2 * LATENCY_S * max(missing, 0.0) if math.isfinite(missing) else 0.0
    return max(FALLS_M_S, arm_m_s, falls_m_s, 0.0 if estimate.abstained else speed_of(estimate)[0])
