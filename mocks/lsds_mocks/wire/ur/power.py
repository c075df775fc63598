"""Power and brakes: transitions from off to running with their durations."""

from __future__ import annotations

from lsds_mocks.wire.ur.modes import RobotMode

OFF_S = 0.3
"""Duration of switching off (s); shorter than a real arm's, to save test time."""
POWERING_S = 0.4
"""Duration of booting the joints (s); shortened, too: a real arm takes about ten seconds in all."""
IDLE_S = 0.4
"""Duration of becoming idle (s); shortened, too."""
BRAKES_S = 0.6
"""Duration of releasing the brakes (s); shortened, too."""


class Power:
    """State machine of the robot mode, driven by time."""

    def __init__(self, mode: RobotMode) -> None:
        self.mode = mode
        self._next: list[tuple[float, RobotMode]] = []

    def on(self, now_s: float) -> None:
        """Switch power on; ends in idle, with the brakes on. Does nothing if the power is on."""
        if self.mode is RobotMode.POWER_OFF and not self._heads_for(RobotMode.IDLE):
            self._plan(now_s, (POWERING_S, RobotMode.POWER_ON), (IDLE_S, RobotMode.IDLE))

    def release(self, now_s: float) -> None:
        """Release the brakes, after powering on if necessary."""
        if self.mode is RobotMode.RUNNING and not self._next:
            return
        if self.mode is RobotMode.POWER_OFF and not self._next:
            self.on(now_s)
        if not self._heads_for(RobotMode.RUNNING):
            last = self._next[-1][0] if self._next else now_s
            self._next.append((last + BRAKES_S, RobotMode.RUNNING))

    def off(self, now_s: float) -> None:
        """Switch off."""
        if self.mode is RobotMode.POWER_OFF:
            self._next.clear()
        else:
            self._plan(now_s, (OFF_S, RobotMode.POWER_OFF))

    def advance(self, now_s: float) -> None:
        """Let time pass."""
        while self._next and now_s >= self._next[0][0]:
            self.mode = self._next.pop(0)[1]

    def _plan(self, now_s: float, *steps: tuple[float, RobotMode]) -> None:
        self._next.clear()
        for duration_s, mode in steps:
            now_s += duration_s
            self._next.append((now_s, mode))

    def _heads_for(self, mode: RobotMode) -> bool:
        return any(planned is mode for _, planned in self._next)
