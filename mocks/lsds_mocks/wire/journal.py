"""Observations of a wire mock: frames from its clients, and the states of its plant."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from lsds.contracts.wire import ReceivedFrame

if TYPE_CHECKING:
    from lsds.clock import Clock
    from lsds_mocks.wire.faults import FaultInjector

MOST_KEPT_FRAMES = 50_000
"""Number of frames kept: those of 100 s of RTDE inputs at 500 Hz. Older ones are discarded."""
MOST_STATES = 50_000
"""Number of states kept: those of 100 s of uninterrupted motion at 500 Hz. Older ones are discarded."""

Meaning = str | Callable[[], str]
"""Text, or the function that returns it: decoding a frame that is never looked at would delay a control cycle."""


class Journal:
    """Log of the frames that clients sent. A frame may start a fault; `started` is called when it does."""

    def __init__(self, faults: FaultInjector, clock: Clock, started: Callable[[], None] = lambda: None) -> None:
        self._faults = faults
        self._clock = clock
        self._started = started
        self._lock = threading.Lock()
        self._frames: deque[tuple[int, int, str, bytes, Meaning]] = deque(maxlen=MOST_KEPT_FRAMES)
        self._count = 0

    def note(self, face: str, data: bytes, meaning: Meaning) -> None:
        """Log one frame, before it is carried out."""
        with self._lock:
            self._frames.append((self._count, self._clock.now(), face, data, meaning))
            self._count += 1
        if self._faults.awaits and self._faults.heard(face, _text(meaning)):
            self._started()

    def received(self, since: int) -> list[ReceivedFrame]:
        """Return the frames with a number of at least `since`."""
        with self._lock:
            frames = [frame for frame in self._frames if frame[0] >= since]
        return [ReceivedFrame(*frame[:4], _text(frame[4])) for frame in frames]


class History:
    """The states of a plant, one for each change. Used by the serving thread only."""

    def __init__(self) -> None:
        self._states: deque[tuple[int, Mapping[str, Any]]] = deque(maxlen=MOST_STATES)

    def add(self, t_ns: int, state: Mapping[str, Any]) -> None:
        """Store a state if it differs from the last one."""
        if not self._states or self._states[-1][1] != state:
            self._states.append((t_ns, state))

    def since(self, t_ns: int, now_ns: int, present: Mapping[str, Any]) -> Sequence[Mapping[str, Any]]:
        """Return the state at a time, all later ones, and the present one; each with its time, `t_ns`."""
        self.add(now_ns, present)
        states = list(self._states)
        later = next((i for i, (at_ns, _) in enumerate(states) if at_ns > t_ns), len(states))
        found = [{"t_ns": at_ns, **state} for at_ns, state in states[max(0, later - 1) :]]
        return [*found, {"t_ns": now_ns, **present}]


def _text(meaning: Meaning) -> str:
    return meaning if isinstance(meaning, str) else meaning()
