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
        """Switch power on; ends in idle, with the brakes on. Does nothing if the power is on or comes on.

        While the arm is being switched off, power comes on after that.
        """
        last_s, last = self._next[-1] if self._next else (now_s, self.mode)
        if last is RobotMode.POWER_OFF:
            powered_s = last_s + POWERING_S
            self._next += [(powered_s, RobotMode.POWER_ON), (powered_s + IDLE_S, RobotMode.IDLE)]

    def release(self, now_s: float) -> None:
        """Release the brakes, after powering on if necessary."""
        self.on(now_s)
        last_s, last = self._next[-1] if self._next else (now_s, self.mode)
        if last is not RobotMode.RUNNING:
            self._next.append((last_s + BRAKES_S, RobotMode.RUNNING))

    def off(self, now_s: float) -> None:
        """Switch off."""
        if self.mode is RobotMode.POWER_OFF:
            self._next.clear()
        else:
            self._next = [(now_s + OFF_S, RobotMode.POWER_OFF)]

    @property
    def goes_off(self) -> bool:
        """Whether it is being switched off."""
        return any(mode is RobotMode.POWER_OFF for _, mode in self._next)

    def advance(self, now_s: float) -> None:
        """Let time pass."""
        while self._next and now_s >= self._next[0][0]:
            self.mode = self._next.pop(0)[1]
