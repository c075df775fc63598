"""A simulated cell with its devices, for the tests."""

from __future__ import annotations

from dataclasses import dataclass

from lsds_mocks.cell.build import build_cell
from lsds_mocks.cell.cell import SimulatedCell
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.devices.gelsight import MockGelSightMini
from lsds_mocks.devices.gelsight_options import GelSightOptions
from lsds_mocks.devices.hand_e import MockHandE
from lsds_mocks.devices.hand_e_options import HandEOptions
from lsds_mocks.devices.ur5e import MockUR5e
from lsds_mocks.devices.ur5e_options import UR5eOptions

from lsds.clock import VirtualClock
from lsds.contracts import ArmCommand, BuildContext, GripperCommand, Twist

MS = 1_000_000
FAR = 10**15
WEAK_M, STRONG_M = 0.0236, 0.0215
"""Apertures that grip the default pipe with about 80 % and about 230 % of what is needed."""


@dataclass
class MockRig:
    clock: VirtualClock
    cell: SimulatedCell
    sensor: MockGelSightMini
    gripper: MockHandE
    arm: MockUR5e

    def until(self, t_ms, every_ms=None):
        """Let time pass; `every_ms` advances the cell in small portions on the way."""
        if every_ms:
            while self.clock.now() + every_ms * MS < t_ms * MS:
                self.clock.sleep_until(round(self.clock.now() + every_ms * MS))
                self.cell.advance(self.clock.now())
        self.clock.sleep_until(round(t_ms * MS))
        self.cell.advance(self.clock.now())

    def truth_now(self):
        """Exact dots at the last step's end, between frames; `seq` is -1."""
        return self.sensor._truth(self.cell.gel_state(), self.cell.t_ns, -1)

    def grip(self, aperture_m, speed=0.05, force=60.0):
        return self.gripper.command(GripperCommand(aperture_m, speed, force, FAR))

    def lift(self, speed=0.038, acceleration=0.5, expires_ns=FAR):
        return self.arm.command(ArmCommand(Twist((0.0, 0.0, speed)), acceleration, expires_ns))


def make_rig(seed=1, *, cell=None, sensor=None, gripper=None, arm=None, start_ns=0, ready=True):
    """Return a rig with a cell on the coarsest fixed grid unless `cell` sets another; other tests cover gel audits."""
    cell = {"fidelity": "pad", "grid": 1, **(cell or {})}
    context = BuildContext(VirtualClock(start_ns), seed)
    rig = MockRig(
        context.clock,
        build_cell(CellOptions(**cell), context),
        MockGelSightMini(GelSightOptions(**(sensor or {})), context),
        MockHandE(HandEOptions(**(gripper or {})), context),
        MockUR5e(UR5eOptions(**(arm or {})), context),
    )
    if ready:
        for device in (rig.sensor, rig.gripper, rig.arm):
            device.connect()
            device.arm()
    return rig


def demonstration(rig, aperture_m, lift_m_s=0.038, until_ms=2500):
    """Grip at 0.1 s, lift from 1.2 s; return the truth every 20 ms."""
    rig.until(100)
    rig.grip(aperture_m)
    rig.until(1200)
    rig.lift(lift_m_s)
    truths = []
    for t_ms in range(1220, until_ms + 1, 20):
        rig.until(t_ms)
        truths.append(rig.cell.truth())
    return truths
