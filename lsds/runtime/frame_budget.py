"""Leaves all but the markers out of frames in which nothing moves, within a mean time per frame.

Frames in which something may move are always evaluated in full: contact patch, imprint, detector, estimator. Frames
at rest are as far as a token bucket allows: every frame adds what the budget leaves over after the markers, load and
grip belief, and a frame that is evaluated in full takes its price. The others reuse the previous results. Half of the
credit is kept, so that moving frames rarely exhaust it.

Prices are nominal, not measured: a run answers the same on every machine, and again when it is replayed.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.tactile.imprint.carrying import fastest

if TYPE_CHECKING:
    from lsds.contracts import DeformationField, Detection

MARKERS_MS = 0.75
"""Time of a frame in which only the markers are followed, up to the command, ms: 0.50 of perception without the contact
patch, 0.20 of the grip belief, 0.05 of the controller (`lsds study frame`, docs/speed.md)."""
IN_FULL_MS = 1.25
"""Further time of contact patch (0.22), imprint (0.60 in the mean), detector (0.25) and estimator (0.18), ms; same
source."""
AVERAGED_FRAMES = 100
"""Number of frames whose savings are kept as credit: some four seconds of a GelSight Mini; chosen."""
MOST_LEFT_OUT = 4
"""Maximum number of successive frames at rest that are not seen in full, whatever the budget; chosen: 0.2 s of a
Mini."""
MOVES_PX = 0.08
"""Motion between two frames, px, above which something moves if a tenth of the markers move by more: four times the
tracker's noise."""
CERTAIN = 0.5
"""Minimum confidence of the last detection of no slip for a frame to count as at rest; chosen."""


class FrameBudget:
    """The budget of one finger.

    `budget_ms` is the mean time that a frame may take, `scale` the time of this machine over the nominal one.
    """

    def __init__(self, budget_ms: float, scale: float = 1.0) -> None:
        self._gain_ms = budget_ms / scale - MARKERS_MS
        self._most_ms = self._credit_ms = AVERAGED_FRAMES * max(self._gain_ms, 0.0)
        self._skipped = MOST_LEFT_OUT

    def affords(self, *, moves: bool) -> bool:
        """Take a frame; return whether it is to be seen in full. `moves`: something may move in it."""
        self._credit_ms = min(self._credit_ms + self._gain_ms, self._most_ms)
        enough = self._credit_ms >= self._most_ms / 2 + IN_FULL_MS or self._gain_ms >= IN_FULL_MS
        if not moves and not enough and self._skipped < MOST_LEFT_OUT:
            self._skipped += 1
            return False
        self._skipped = 0
        self._credit_ms = max(self._credit_ms - IN_FULL_MS, 0.0)
        return True


def may_move(field: DeformationField, last: Detection | None, metres_per_px: float) -> bool:
    """Return whether something may move in a frame: the markers do, or the last detection is not sure that nothing
    slips."""
    if last is None or last.slip is not False or not last.confidence >= CERTAIN:
        return True
    known = field.velocity_m_s[np.isfinite(field.velocity_m_s[:, 0])]
    if not len(known) or not math.isfinite(field.dt_s):
        return True
    return fastest(known) * field.dt_s > MOVES_PX * metres_per_px
