"""Timing of a mock camera: exposures, when each frame becomes readable, and lost frames."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds.clock import NS_PER_S

if TYPE_CHECKING:
    from lsds_mocks.cell.touch import GelTouch
    from lsds_mocks.devices.gelsight_options import GelSightOptions
    from lsds_mocks.gel.state import GelState

SNAPSHOTS_KEPT = 64
"""Number of the newest snapshots that a camera keeps for a later look at their truth; chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """One exposure: the gel's state at `t_ns`.

    `image_of` is the (t_ns, seq) of the image that it shows: its own, or an earlier one if the camera repeats a frame.
    """

    seq: int
    t_ns: int
    available_ns: int
    state: GelState
    image_of: tuple[int, int]


class Shutter:
    """Exposes on a jittered schedule and keeps snapshots until they are superseded.

    The schedule is drawn frame by frame from a separate random stream, so that it does not depend on reads.
    """

    def __init__(self, options: GelSightOptions, start_ns: int, seed: list[int]) -> None:
        self._options = options
        self._rng = np.random.default_rng(seed)
        self._period_ns = NS_PER_S / options.rate_hz
        self._start_ns = start_ns
        self._first_ns = start_ns + options.first_frame_ms * 1e6
        self._seq = 0
        self._available_ns = 0
        self._waiting: deque[Snapshot] = deque()
        self.kept: deque[Snapshot] = deque(maxlen=SNAPSHOTS_KEPT)
        self._next_ns = 0
        self._schedule()

    @property
    def next_exposure_ns(self) -> int:
        """Time of the next exposure."""
        return self._next_ns

    def expose(self, touch: GelTouch) -> None:
        """Record the state at `next_exposure_ns`."""
        options, t_ns, seq, state = self._options, self._next_ns, self._seq, touch.state
        lost, repeated, tail = self._rng.random(), self._rng.random(), self._rng.exponential()
        latency_ns = round((options.latency_ms + options.latency_jitter_ms * min(tail, 8.0)) * 1e6)
        self._available_ns = max(self._available_ns, t_ns + latency_ns)
        image_of = (t_ns, seq)
        since_start_s = (t_ns - self._start_ns) / NS_PER_S
        frozen = options.freeze_at_s is not None and since_start_s >= options.freeze_at_s
        if self.kept and (frozen or repeated < options.duplicate_probability):
            state, image_of = self.kept[-1].state, self.kept[-1].image_of
        snapshot = Snapshot(seq, t_ns, self._available_ns, state, image_of)
        self.kept.append(snapshot)
        silent = options.silent_at_s is not None and since_start_s >= options.silent_at_s
        if not silent and lost >= options.drop_probability:
            self._waiting.append(snapshot)
        # Only the newest readable frame can be read, so older ones can be dropped.
        while len(self._waiting) >= 2 and self._waiting[1].available_ns <= t_ns:
            self._waiting.popleft()
        self._seq += 1
        self._schedule()

    def newest(self, now_ns: int) -> Snapshot | None:
        """Return the newest frame that has become readable."""
        while len(self._waiting) >= 2 and self._waiting[1].available_ns <= now_ns:
            self._waiting.popleft()
        return self._waiting[0] if self._waiting and self._waiting[0].available_ns <= now_ns else None

    def _schedule(self) -> None:
        bound = 0.3 * self._period_ns
        jitter = min(max(self._rng.standard_normal() * self._options.jitter_ms * 1e6, -bound), bound)
        self._next_ns = round(self._first_ns + self._seq * self._period_ns + jitter)
