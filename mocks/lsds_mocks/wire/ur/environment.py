"""External forces on the tool: an optional floor, a wrench set by a client, and the load of a shared plant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds

if TYPE_CHECKING:
    from lsds.clock import Clock
    from lsds.contracts.plant_links import ArmLink

FLOOR_N_M = 20_000.0
"""Stiffness of the floor, N/m; chosen."""
FLOOR_N_S_M = 50.0
"""Damping of the floor, N s/m; chosen."""


class Environment:
    """Forces on the tool. `floor_m` is the height of a level floor in the base frame; None for no floor."""

    def __init__(self, floor_m: float | None = None, link: ArmLink | None = None, clock: Clock | None = None) -> None:
        self._floor_m = floor_m
        self._link = link
        self._clock = clock
        self.external = [0.0] * 6

    def follow(self, time_s: float, tcp_pose: Sequence[float], tcp_speed: Sequence[float]) -> None:
        """Send the tool's position to the plant."""
        if self._link is not None:
            now_ns = self._clock.now() if self._clock is not None else nanoseconds(time_s)
            self._link.follow(now_ns, tcp_pose[2], tcp_speed[2])

    def wrench(self, tcp_pose: Sequence[float], tcp_speed: Sequence[float]) -> list[float]:
        """Return force (N) and torque (Nm) on the tool in the base frame."""
        wrench = list(self.external)
        if self._floor_m is not None and tcp_pose[2] < self._floor_m:
            depth = self._floor_m - tcp_pose[2]
            wrench[2] += max(0.0, FLOOR_N_M * depth - FLOOR_N_S_M * tcp_speed[2])
        if self._link is not None:
            wrench[2] -= self._link.load().pull_n
        return wrench

    def close(self) -> None:
        """Give the link back."""
        if self._link is not None:
            self._link.close()
