"""The queue of commands from a device mock to the plant: seeded latency, in order, cancelled by a stop."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.errors import CommandExpired

if TYPE_CHECKING:
    from lsds.contracts.plant import Action, Motion, Plant


class CommandLine:
    """Sends actions to the cell under one device's name.

    An action takes effect `latency` after it was sent, rounded up to the device's cycle, never before an earlier
    action. A stop takes effect at once and cancels all pending actions.
    """

    def __init__(
        self, cell: Plant, name: str, *, latency_ms: float, jitter_ms: float, cycle_ns: int, seed: list[int]
    ) -> None:
        self._cell = cell
        self._name = name
        self._latency_ms = latency_ms
        self._jitter_ms = jitter_ms
        self._cycle_ns = cycle_ns
        self._rng = np.random.default_rng(seed)
        self._last_ns = 0
        self._stops: list[int] = []

    def send(self, now_ns: int, action: Action, *, lost: float = 0.0) -> int:
        """Send an action; return when it takes effect (ns). With probability `lost` it never does."""
        spread, fate = self._rng.uniform(-1, 1), self._rng.random()
        latency_ns = max(0.0, self._latency_ms - 0.5e-6 * self._cycle_ns + spread * self._jitter_ms) * 1e6
        effect_ns = math.ceil((now_ns + latency_ns) / self._cycle_ns) * self._cycle_ns
        self._last_ns = effect_ns = max(self._last_ns, effect_ns)
        if fate >= lost:
            self.post(effect_ns, action)
        return effect_ns

    def post(self, effect_ns: int, action: Action) -> None:
        """Schedule an action for an instant; a stop before that instant cancels it."""
        generation = len(self._stops)

        def unless_stopped(motion: Motion) -> None:
            if len(self._stops) <= generation or self._stops[generation] >= effect_ns:
                action(motion)

        self._cell.post(effect_ns, self._name, unless_stopped)

    def stop(self, now_ns: int, action: Action) -> None:
        """Perform `action` at once and cancel all pending actions."""
        self._stops.append(now_ns)
        self._cell.post(now_ns, self._name, action)


def require_unexpired(device: str, now_ns: int, expires_ns: int) -> None:
    """Raise CommandExpired for a command that came at or after its expiry."""
    if now_ns >= expires_ns:
        late_ms = (now_ns - expires_ns) / 1e6
        raise CommandExpired(device, f"command came {late_ms:.1f} ms after its expiry", remedy="send a fresh one")
