"""The friction limit: how much load a squeeze carries, learnt from what slipped and from what held.

The ratio r = load / squeeze needs no unit: load follows the tangential force and squeeze the normal force, each to a
constant, so at the limit of friction r is the coefficient times these constants, and they cancel where r is used.
No frame can show more than the limit: what holds is below static friction, what slides is at kinetic friction, which is
lower. Once something has slipped, the greatest ratio since shortly before that slip is therefore the best estimate of
it, unless the slip is at a ratio so much lower that the surface must have changed.
"""

from __future__ import annotations

import math
from collections import deque
from statistics import median, median_low

KINETIC_SHARE = 0.7
"""Sliding friction is at least this share of static friction: an alarm at a lower ratio than was held is none."""
CAUGHT_SHARE = 0.82
"""While an object slides, load follows squeeze. Where the ratio has fallen below this share of what it was in the same
slip, the load is that of an object which is carried, and does not grow any more."""
FORGET_S = 4.0
"""Time in which what held loses two thirds of its weight: a surface may get wet."""
RECENT = 5
"""Frames of a slip that its ratio is the median of."""
BEFORE = 6
"""Frames before a slip that tell of static friction."""
MEDIAN = 3
"""Frames whose median ratio counts: one frame's load may be wrong, and too high a limit is too weak a grip."""


class FrictionLimit:
    """What is known of the limit, in units of load over squeeze. `held` is the greatest ratio that was held lately;
    `limit` the greatest since shortly before the last slip, NaN as long as nothing slipped."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Know nothing: another object, or another grip of it."""
        self.held = 0.0
        self.limit = math.nan
        self._suspected = math.nan
        self._sliding: deque[float] = deque(maxlen=RECENT)
        self._newest: deque[float] = deque(maxlen=MEDIAN)
        self._before: deque[float] = deque(maxlen=BEFORE)

    @property
    def known(self) -> bool:
        """Whether something has slipped."""
        return self.limit > 0

    @property
    def slipping(self) -> bool:
        """Whether the last frame taken slipped."""
        return bool(self._sliding)

    def holds(self, ratio: float, dt_s: float) -> None:
        """Take a frame in which nothing slips."""
        self._sliding.clear()
        self._newest.append(ratio)
        ratio = median_low(self._newest)
        self._before.append(ratio)
        self.held = max(ratio, self.held * math.exp(-dt_s / FORGET_S) if dt_s > 0 else self.held)
        if self.known:
            self.limit = max(self.limit, ratio)

    def slips(self, ratio: float, *, sure: bool) -> None:
        """Take a frame that slips. A slip is one, and its limit known, where it is `sure` or shown by a second frame in
        a row."""
        self.held = min(self.held, ratio)
        self._newest.append(ratio)
        begins = not self._sliding
        self._sliding.append(ratio)
        if begins:
            static = max(self._before, default=0.0)
            # A frame that shows more than ever held may be wrong.
            seen = min(ratio, median_low(self._newest)) if ratio > static else ratio
            self._suspected = static if KINETIC_SHARE * static < seen < static else seen
            self._before.clear()
        else:
            self._suspected = max(self._suspected, median_low(self._newest))
        if sure or len(self._sliding) > 1:
            self.limit = self._suspected

    def refutes(self, ratio: float) -> bool:
        """Tell whether an alarm contradicts what was held, or the slip that it is said to continue.

        Ask only while the load is what it was: a surface that gets wet slips at a lower ratio, and its load falls.
        """
        if self._sliding:
            return ratio < CAUGHT_SHARE * median(self._sliding)
        return ratio < KINETIC_SHARE * max(self.held, self.limit if self.known else 0.0)

    def squeeze_m(self, load_n: float, margin: float) -> float:
        """Return the squeeze (m) that carries a load with a margin; NaN as long as nothing slipped."""
        return margin * load_n / self.limit if self.known else math.nan
