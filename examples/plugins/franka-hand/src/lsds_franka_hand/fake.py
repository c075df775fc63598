"""A fake of the hand: the same blocking calls, and a width that follows them in real time.

Its faults are those that libfranka's issues report: a stop without effect, a failed command, a lost connection, and a
hand that sends no state.
"""

from __future__ import annotations

import threading
from typing import NamedTuple

from lsds.clock import Clock, nanoseconds, seconds

STEP_S = 0.002
"""Time between looks at the width while a command blocks (s)."""
STATE_NS = 50_000_000
"""Time between two states (ns), assumed."""
WIDEST_M = 0.08


class FakeState(NamedTuple):
    """A state as libfranka reports it."""

    width: float
    max_width: float
    is_grasped: bool


class CommandError(RuntimeError):
    """The hand ended a command without success."""


class NetworkError(RuntimeError):
    """The connection is lost."""


class Fingers:
    """The mechanics, shared by all connections. Its public fields are for tests."""

    def __init__(self, clock: Clock, object_m: float = 0.0) -> None:
        self.clock = clock
        self.object_m = object_m
        self.max_width_m = WIDEST_M
        self.force_n = 0.0
        self.grasped = False
        self.stops = 0
        self.stop_works = True
        self.lingers_s = 0.0
        self.fails = self.lost = self.silent = False
        self.commands: list[tuple[str, float]] = []
        self._lock = threading.Lock()
        self.running = self._aborted = False
        self._start_m = self._end_m = WIDEST_M
        self._start_ns, self._speed_m_s = clock.now(), 1.0

    @property
    def width_m(self) -> float:
        """Present width."""
        left_m = self._end_m - self._start_m
        reach_m = self._speed_m_s * seconds(self.clock.now() - self._start_ns)
        return self._end_m if reach_m >= abs(left_m) else self._start_m + (reach_m if left_m > 0 else -reach_m)

    def run(self, call: str, width_m: float, speed_m_s: float, force_n: float) -> bool:
        """Move the fingers and block until they are there. Raises CommandError if the command is stopped."""
        with self._lock:
            self.check()
            if self.running:
                raise CommandError("another command runs")
            if self.fails:
                raise CommandError("command rejected")
            self.commands.append((call, width_m))
            self.running, self._aborted = True, False
            touches = width_m < self.object_m <= self._start_m + 1e-9
            self._go(max(width_m, self.object_m) if touches else width_m, speed_m_s)
            self.grasped, self.force_n = False, 0.0
        try:
            # A move onto an object waits for a width that it does not reach.
            while abs(self.width_m - self._end_m) > 1e-9 or (touches and call == "move"):
                self.clock.sleep_until(self.clock.now() + nanoseconds(STEP_S))
                self.check()
                if self._aborted:
                    break
            if call == "grasp" and not self._aborted:
                self.grasped, self.force_n = True, force_n
                self._linger()
            if self._aborted:
                raise CommandError("command aborted")
        finally:
            self.running = False
        return True

    def stop(self) -> None:
        """End the motion; without one, take the pressure off."""
        with self._lock:
            self.check()
            self.stops += 1
            if not self.stop_works:
                return
            self.grasped, self.force_n = False, 0.0
            if self.running:
                self._go(self.width_m, 1.0)
                self._aborted = True

    def place(self, width_m: float) -> None:
        """Put the fingers at a width."""
        self._start_m = self._end_m = width_m

    def check(self) -> None:
        """Raise NetworkError if the connection is lost."""
        if self.lost:
            raise NetworkError("connection lost")

    def _linger(self) -> None:
        """Block for a while after the contact, as a slow hand does."""
        until_ns = self.clock.now() + nanoseconds(self.lingers_s)
        while self.clock.now() < until_ns and not self._aborted:
            self.clock.sleep_until(self.clock.now() + nanoseconds(STEP_S))

    def _go(self, end_m: float, speed_m_s: float) -> None:
        self._start_m, self._start_ns = self.width_m, self.clock.now()
        self._end_m, self._speed_m_s = end_m, speed_m_s


class FakeHand:
    """One connection: a `Hand`."""

    def __init__(self, fingers: Fingers) -> None:
        self._fingers = fingers
        self._state_ns = 0
        self._lost = False
        fingers.check()

    def move(self, width: float, speed: float) -> bool:
        """Move to a width."""
        return self._fingers.run("move", width, speed, 0.0)

    def grasp(self, width: float, speed: float, force: float, epsilon_inner: float, epsilon_outer: float) -> bool:
        """Close to a width or an object; false if the fingers rest outside of the tolerance."""
        fingers = self._fingers
        fingers.run("grasp", width, speed, force)
        return width - epsilon_inner < fingers.width_m < width + epsilon_outer

    def homing(self) -> bool:
        """Open, and know the greatest width."""
        self._fingers.run("homing", WIDEST_M, 0.1, 0.0)
        self._fingers.max_width_m = WIDEST_M
        return True

    def stop(self) -> bool:
        """End the command that runs."""
        self._fingers.stop()
        return True

    def read_once(self) -> FakeState:
        """Wait for the next state."""
        fingers = self._fingers
        fingers.clock.sleep_until(self._state_ns)
        while fingers.silent:
            fingers.clock.sleep_until(fingers.clock.now() + nanoseconds(STEP_S))
        # A connection that was lost once stays lost.
        self._lost |= fingers.lost
        if self._lost:
            raise NetworkError("connection lost")
        self._state_ns = fingers.clock.now() + STATE_NS
        return FakeState(fingers.width_m, fingers.max_width_m, fingers.grasped)
