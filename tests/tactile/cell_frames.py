"""Frames of the simulated cell with the truth of its gel's surface."""

from __future__ import annotations

import numpy as np
from lsds_mocks.cell.build import build_cell
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


class CellBench:
    """A cell whose sensor, gripper and arm are connected and armed."""

    def __init__(self, seed=1, fidelity="auto", **sensor):
        self.clock = VirtualClock()
        context = BuildContext(self.clock, seed)
        self.cell = build_cell(CellOptions(fidelity=fidelity), context)
        self.sensor = MockGelSightMini(GelSightOptions(**sensor), context)
        self.gripper = MockHandE(HandEOptions(), context)
        self.arm = MockUR5e(UR5eOptions(), context)
        for device in (self.sensor, self.gripper, self.arm):
            device.connect()
            device.arm()

    def until(self, t_ms):
        self.clock.sleep_until(round(t_ms * MS))
        self.cell.advance(self.clock.now())

    def grip(self, aperture_m):
        self.gripper.command(GripperCommand(aperture_m, 0.05, 60.0, FAR))

    def lift(self, speed=0.038):
        self.arm.command(ArmCommand(Twist((0.0, 0.0, speed)), 0.5, FAR))

    def frames(self, count, from_ms):
        """New frames every 40 ms."""
        frames = []
        for i in range(count):
            self.until(from_ms + 40 * i)
            frames.append(self.sensor.read())
        return frames

    def true_area(self, threshold_m=50e-6):
        """Share of the image where the gel's true surface is deeper than the threshold, and the indentation (m).

        Eight points a pixel across the pipe, so that the truth does not come in steps of a column.
        """
        spec = self.sensor.spec
        x = ((np.arange(8 * spec.width_px) + 0.5) / 8 - spec.width_px / 2) * spec.metres_per_px
        y = (np.arange(0, spec.height_px, 4) + 2.0 - spec.height_px / 2) * spec.metres_per_px
        state = self.cell.gel_state()
        return float((self.cell.plant.gel.depth(state, x, y) > threshold_m).mean()), state.indentation_m


def grasp_and_lift(seed=1, count=40, **sensor):
    """Five reference frames of the untouched gel and `count` frames of a grasp and a lift that slips a little."""
    bench = CellBench(seed, **sensor)
    reference = bench.frames(5, 400)
    bench.until(600)
    bench.grip(0.0236)
    grasp = bench.frames(count // 2, 700)
    bench.until(1600)
    bench.lift()
    return bench.sensor.spec, reference, grasp + bench.frames(count - count // 2, 1640)
