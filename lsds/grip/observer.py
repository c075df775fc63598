"""Estimates the grip: feeds the belief once per round of fingers with load, squeeze and evidence of slip."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from statistics import median
from typing import TYPE_CHECKING, Any

from lsds.clock import nanoseconds
from lsds.contracts.grip import MAYBE
from lsds.grip.belief import GripBelief
from lsds.grip.evidence import SlipEvidence
from lsds.grip.rising_load import RisingLoad
from lsds.tactile.bridging import VelocityBridge
from lsds.tactile.carried_load import LEAST_EVIDENCE_N, MEDIAN_FRAMES, CarriedLoad
from lsds.tactile.contact_load import speed_of
from lsds.tactile.contact_size import half_length_of
from lsds.tactile.touch_offset import LEAST_STD_M, TouchOffset

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds.contracts import FingerCycle, GripEstimate, SlipEstimate
    from lsds.grip.options import GripOptions

ASSUMED_SQUEEZE_M = 1.5e-3
"""Squeeze that is assumed if the job does not know the aperture at touch, m; chosen."""
LEAST_SQUEEZE_M = 3e-4
"""Minimum squeeze that is known well enough to divide by, m; chosen."""
CHANGED_SQUEEZE_M = 1e-4
"""Difference above which the squeeze has changed, m; chosen."""
SETTLES_S = 0.1
"""Time after a change of the squeeze from which the normal force is that of the squeeze, s; chosen."""
ROUND_M = 7e-3
"""Half-length below which a contact ends within the pad and is round, m: spheres of 10 to 44 mm begin with 1.8 to
6.3 mm, cylinders and edges cross the pad and have 8.8 mm or more (simulated)."""
ROUND_ADDS = 0.3
"""By how much the power of the squeeze is greater for a round contact (`lsds_research.studies.grip.fit_power`)."""
FALLS_M_S = 0.04
"""Minimum speed of a slide in the air, m/s: an object of which friction carries nine tenths reaches it in 40 ms."""
WALK_M_S = 0.14
"""Random walk of the slip velocity, m/s per root of a second: the change between successive frames that move, less the
estimator's variance, in 14 real recordings of development objects."""
WALK_RAD_S = 16.0
"""Random walk of the angular slip velocity, rad/s per root of a second; from the same recordings."""
GRAVITY_M_S2 = 9.81
"""Acceleration of a falling object, m/s^2."""


class GripObserver:
    """Estimates the grip of one object.

    `answer_s` is the time from a change at the object to the fingers' answer, `compiled` whether compiled functions
    compute the belief.
    """

    def __init__(self, options: GripOptions, answer_s: float, *, compiled: bool = False) -> None:
        self.belief = GripBelief(options, answer_s, compiled=compiled)
        self._options = options
        self._answer_s = answer_s
        self.reset()

    def reset(self) -> None:
        """Forget the object."""
        self.belief.reset()
        self._rising = RisingLoad(self._options)
        self.load, self._evidence = CarriedLoad(), SlipEvidence(self._answer_s)
        self._bridge = VelocityBridge(WALK_M_S, WALK_RAD_S)
        self._counted: dict[str, int] = {}
        self._unmeasured_s = self._fastest_m_s = 0.0
        self._round_ns: int | None = None
        self._speeds: deque[tuple[int, float]] = deque()
        self._noticed_m = self._touch_m = self._squeeze_m = self._left_m = self._before_n = math.nan
        self._offset, self._offset_m = TouchOffset(self._options.power), 0.0
        self._changed_ns = -nanoseconds(1.0)
        self._squeezes = self._doubts = 0
        self._pressed: str | None = None
        self._normals: list[float] = []
        self._half_lengths_m: list[float] = []
        self._believed: dict[str, Any] = {}

    def update(
        self,
        seen: GripEstimate,
        *,
        supported: bool = False,
        speed_m_s: float = math.inf,
        touch_std_m: float = LEAST_STD_M,
    ) -> GripEstimate:
        """Take what is seen in a frame; return it with what is believed.

        `speed_m_s` is the arm's, `supported` whether the object may still stand on its support, `touch_std_m` the
        standard deviation of the touch. Without an aperture, as where there is no gripper, only the evidence of slip
        counts.
        """
        self.load.take(seen.t_ns, seen.fingers)
        estimate, bridged = self._bridge.update(seen.estimate, seen.dt_s)
        self._speeds.append((seen.t_ns, speed_m_s))
        # The arm may still move as fast as was wanted a while ago.
        while self._speeds[0][0] < seen.t_ns - nanoseconds(self._answer_s):
            self._speeds.popleft()
        squeeze_m = self._see_squeeze(seen, touch_std_m)
        complete = self._completes(seen.fingers) or not self._believed
        if complete:
            self._believed = self._believe(seen, squeeze_m, estimate, supported, speed_m_s)
        return replace(seen, estimate=estimate, bridged=bridged, complete=complete, **self._believed)

    def _see_squeeze(self, seen: GripEstimate, touch_std_m: float) -> float:
        """Note touch, and when the squeeze changes; return the squeeze (m), counted from where the object begins."""
        noticed_m = seen.touch_m
        if not math.isfinite(noticed_m):
            assumed_m = seen.aperture_m + ASSUMED_SQUEEZE_M
            noticed_m = self._noticed_m if math.isfinite(self._noticed_m) else assumed_m
            touch_std_m = math.nan
        if math.isfinite(noticed_m) and noticed_m != self._noticed_m:
            self._move_touch(noticed_m, seen.aperture_m)
        closed_m = self._noticed_m - seen.aperture_m
        if math.isfinite(closed_m) and not abs(closed_m - self._squeeze_m) < CHANGED_SQUEEZE_M:
            self._left_m = self._squeeze_m if math.isfinite(self._squeeze_m) else closed_m
            self._changed_ns, self._squeeze_m = seen.t_ns, closed_m
            self._squeezes += 1
        offset_m = self._offset.take(closed_m, self._normal_now(seen), touch_std_m)
        if abs(offset_m - self._offset_m) > CHANGED_SQUEEZE_M:
            # The limit was learnt at the squeeze before.
            self._recount(self._left_m - self._offset_m, self._left_m - offset_m)
            self._offset_m = offset_m
        self._touch_m = self._noticed_m - self._offset_m
        return max(closed_m - self._offset_m, LEAST_SQUEEZE_M)

    def _move_touch(self, noticed_m: float, aperture_m: float) -> None:
        """Count from another touch, which a job has noticed since."""
        if math.isfinite(self._touch_m):
            self._recount(self._touch_m - aperture_m, noticed_m - aperture_m)
        self._noticed_m, self._squeeze_m = noticed_m, math.nan
        self._offset, self._offset_m = TouchOffset(self.belief.power), 0.0

    def _recount(self, before_m: float, now_m: float) -> None:
        """Count a squeeze (m) as another one: what is known of the limit there stays known."""
        self.belief.rescale(1e3 * max(before_m, LEAST_SQUEEZE_M), 1e3 * max(now_m, LEAST_SQUEEZE_M))
        self._rising.forget()

    def _normal_now(self, seen: GripEstimate) -> float:
        """Return the normal force (N) of the finger that first showed one, if this frame is its; NaN otherwise.

        Another finger's, or that of an earlier frame, does not belong to the aperture of this frame. Of a skipped
        frame it is that of an earlier one.
        """
        if self._pressed is None:
            self._pressed = next(iter(self.load.normals_n), None)
        for finger in seen.fingers:
            if finger.finger == self._pressed and finger.observation.t_ns == seen.t_ns and not finger.skipped:
                return self.load.normals_n.get(finger.finger, math.nan)
        return math.nan

    def _completes(self, fingers: Sequence[FingerCycle]) -> bool:
        """Return whether each finger has shown something since the last round: fingers are seen one after the other,
        and one frame of a finger must not confirm itself."""
        if any(self._counted.get(finger.finger) == finger.observation.t_ns for finger in fingers):
            return False
        self._counted = {finger.finger: finger.observation.t_ns for finger in fingers}
        return True

    def _believe(
        self, seen: GripEstimate, squeeze_m: float, estimate: SlipEstimate, supported: bool, speed_m_s: float
    ) -> dict[str, Any]:
        """Feed the belief with a round; return what it says of the grip."""
        # Of fingers that are seen one after the other, a frame may be older than the last one of the round before.
        round_s = 0.0 if self._round_ns is None else max((seen.t_ns - self._round_ns) * 1e-9, 0.0)
        self._round_ns = seen.t_ns if self._round_ns is None else max(seen.t_ns, self._round_ns)
        load, load_n, rate = self.load, self.load.now_n, 0.0
        arm_m_s = max(speed for _, speed in self._speeds)
        rests_s = (seen.t_ns - self._changed_ns) * 1e-9
        # A job begins to act when the fingers rest, so the first squeeze has settled.
        if not all(finger.skipped for finger in seen.fingers):
            if len(self._normals) < MEDIAN_FRAMES:
                settled = math.isfinite(squeeze_m) and (self._squeezes == 1 or rests_s > SETTLES_S)
                self._see_normal(seen.fingers, squeeze_m, settled=settled)
            self._doubts = self._doubts + 1 if load.doubted else 0
            if self._doubts == MEDIAN_FRAMES:
                self.belief.doubt_normal()
        limit_n, limit_std_n, rising_m = math.nan, math.nan, 0.0
        stands = supported and not speed_m_s > 0
        evidence = self._evidence.take(seen.detection, estimate, rests_s)
        if not (load.fresh and math.isfinite(squeeze_m)):
            # The last load measured is no new evidence.
            self.belief.weigh(evidence, 1e3 * squeeze_m, round_s, stands)
            self._unmeasured_s += round_s
            self._fastest_m_s = max(self._fastest_m_s, arm_m_s)
        else:
            since_s, self._unmeasured_s = round_s + self._unmeasured_s, 0.0
            if math.isfinite(self._before_n) and since_s > 0:
                rate = (load_n - self._before_n) / since_s
            self._before_n = load_n
            moved_mm = 1e3 * since_s * max(self._fastest_m_s, arm_m_s) if since_s > 0 else 0.0
            self._fastest_m_s = 0.0
            # Noise and creep of the gel reach that load: of a smaller one only this is known.
            faint, known_n = not load_n > LEAST_EVIDENCE_N, max(load_n, LEAST_EVIDENCE_N)
            self.belief.update(known_n, 1e3 * squeeze_m, round_s, evidence, stands, moved_mm, faint=faint)
            if faint or supported or self.belief.slips > MAYBE:
                self._rising.forget(seen.t_ns)
            else:
                rising_m = self._rising.required_m(seen.t_ns, load_n, squeeze_m, self._answer_s, speed_m_s)
        if load_n > LEAST_EVIDENCE_N and math.isfinite(squeeze_m):
            limit_n, limit_std_n = self.belief.limit_n(1e3 * squeeze_m)
        return {
            "touch_m": self._touch_m,
            "squeeze_m": squeeze_m,
            "load_n": load_n,
            "load_n_s": rate,
            "greatest_n": load.greatest_n,
            "rising_m": rising_m,
            "stale": load.stale,
            "normal_n": load.normal_n,
            "reach_m": load.reach_m,
            "limit_n": limit_n,
            "limit_std_n": limit_std_n,
            "slips": self.belief.slips,
            "slip_m_s": self._slide_m_s(arm_m_s, estimate, supported),
            "required_m": self._required_m,
        }

    def _see_normal(self, fingers: Sequence[FingerCycle], squeeze_m: float, *, settled: bool) -> None:
        """Take the normal force of a frame; once enough have settled, the belief knows their median."""
        normal_n = self.load.normal_n
        if not (settled and normal_n > 0):
            self._normals.clear()
            self._half_lengths_m.clear()
            return
        self._normals.append(normal_n)
        lengths_m = (half_length_of(finger.observation.contact) for finger in fingers)
        self._half_lengths_m.append(max(filter(math.isfinite, lengths_m), default=math.nan))
        if len(self._normals) == MEDIAN_FRAMES:
            if median(self._half_lengths_m) < ROUND_M:
                self._become_round(squeeze_m)
            self.belief.know_normal(median(self._normals), 1e3 * squeeze_m)

    def _become_round(self, squeeze_m: float) -> None:
        """Let the normal force grow as that of a round contact."""
        power = self._options.power + ROUND_ADDS
        self.belief.know_power(power, 1e3 * squeeze_m)
        self._offset.power = power
        self._rising = RisingLoad(self._options, power)

    def _required_m(self, risk: float, margin: float, load_n: float, braking: float) -> float:
        """Return the least squeeze (m) at which `margin` times the load exceeds the friction limit with this risk."""
        return 1e-3 * self.belief.squeeze_mm(risk, margin, load_n, braking)

    def _slide_m_s(self, arm_m_s: float, estimate: SlipEstimate, supported: bool) -> float:
        """Return how fast an object slides if it does: the arm draws the fingers along what stands; what hangs falls.

        Of what hangs, friction that carries less than the greatest load of late leaves the rest to gravity until the
        fingers answer. A difference within the noise of a load leaves nothing.
        """
        arm_m_s = arm_m_s if math.isfinite(arm_m_s) else FALLS_M_S
        if supported:
            return arm_m_s
        load_n, carried_n = self.load.now_n, self.load.greatest_n
        missing = 1 - (load_n + LEAST_EVIDENCE_N) / carried_n if carried_n > LEAST_EVIDENCE_N else 0.0
        falls_m_s = GRAVITY_M_S2 * self._answer_s * max(missing, 0.0) if math.isfinite(missing) else 0.0
        return max(FALLS_M_S, arm_m_s, falls_m_s, 0.0 if estimate.abstained else speed_of(estimate)[0])
