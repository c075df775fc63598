"""The driver on a fake hand whose faults the tests set."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from lsds.clock import WallClock
from lsds.contracts import GripperCommand

from lsds_franka_hand.fake import FakeHand, Fingers
from lsds_franka_hand.gripper import FrankaHand
from lsds_franka_hand.options import DriverOptions


class Cell:
    """One fake hand, and the drivers that were built on it."""

    def __init__(self, object_mm: float) -> None:
        self.fingers = Fingers(WallClock(), object_mm * 1e-3)
        self.grippers: list[FrankaHand] = []

    def driver(self, **options: Any) -> FrankaHand:
        """Return a new driver."""
        hand = FrankaHand("franka-hand", lambda: FakeHand(self.fingers), DriverOptions(**options), WallClock())
        self.grippers.append(hand)
        return hand

    def armed(self, **options: Any) -> FrankaHand:
        """Return a driver that is armed."""
        gripper = self.driver(**options)
        gripper.connect()
        gripper.arm()
        return gripper


@pytest.fixture
def cell(request: pytest.FixtureRequest) -> Iterator[Cell]:
    """A hand. Parametrize it indirectly with the width of an object (mm)."""
    cell = Cell(getattr(request, "param", 0.0))
    yield cell
    cell.fingers.silent, cell.fingers.stop_works = False, True
    for gripper in cell.grippers:
        gripper.close()


def send(gripper: FrankaHand, aperture_m: float, *, speed_m_s: float = 0.1, force_n: float = 30.0) -> GripperCommand:
    """Send a command that expires in 5 s."""
    return gripper.command(GripperCommand(aperture_m, speed_m_s, force_n, time.monotonic_ns() + 5_000_000_000))


def wait(done: Callable[[], bool], timeout_s: float = 5.0) -> None:
    """Wait until something is true."""
    deadline = time.monotonic() + timeout_s
    while not done():
        assert time.monotonic() < deadline, "timeout"
        time.sleep(0.002)
