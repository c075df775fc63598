"""Rounds: when every finger has shown something new.

Fingers are seen one after the other, and what each saw last is told with every frame of another. What counts frames in
a row (medians, a second alarm) counts rounds, or one frame of a finger would confirm itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds.contracts import FingerCycle


class Rounds:
    """Counts rounds. Feed it the fingers of every frame."""

    def __init__(self) -> None:
        self._counted: dict[str, int] = {}

    def restart(self, fingers: Sequence[FingerCycle]) -> None:
        """Begin a round: what the fingers have shown by now does not count."""
        self._counted = {finger.finger: finger.observation.t_ns for finger in fingers}

    def completes(self, fingers: Sequence[FingerCycle]) -> bool:
        """Return whether each finger has shown something since the last round was complete; true without any."""
        if any(self._counted.get(finger.finger) == finger.observation.t_ns for finger in fingers):
            return False
        self.restart(fingers)
        return True
