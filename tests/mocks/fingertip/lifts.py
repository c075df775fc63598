"""Lifts by the simulated cell and by fingertips in MuJoCo at the same aperture.

`python -m tests.mocks.fingertip.lifts [FIDELITY [OBJECT ...]]` compares them, for all objects of the catalogue unless
some are named, and prints how many times faster than real time one core steps the MuJoCo scene.
"""

from __future__ import annotations

import sys
import time
from typing import NamedTuple

from lsds_mocks.cell.build import build_plant
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.fingertip.pipe import CLEARANCE_M, pipe_scene
from lsds_mocks.objects.catalogue import CATALOGUE
from lsds_mocks.plant.lift import GRAVITY_M_S2

EVEN = {"fidelity": "winkler", "texture_amplitude": 0.0, "chatter_amplitude": 0.0, "vibration_um": 0.0}
"""Friction equal everywhere, because cell and scene draw different surfaces."""
GRIP_S, LIFT_S = 0.3, 0.4
SPEED_M_S, ACCELERATION_M_S2 = 0.03, 0.5
CELL_STEP_S = 2e-3


class Lift(NamedTuple):
    """Forces at the end of a lift, slip since its beginning, and the speed of the simulation over real time."""

    normal_n: float
    tangential_n: float
    slip_m: float
    speed: float = 0.0


def closure(options: CellOptions, ratio: float) -> float:
    """Closure of a finger beyond touch (m) at which the normal force is `ratio` times the needed one."""
    needed = ratio * options.mass_kg * GRAVITY_M_S2 / 2 / options.static_friction
    plant = build_plant(options, [0])
    low, high = 0.0, 8e-3
    for _ in range(30):
        middle = (low + high) / 2
        plant.fingers.aperture_m = options.diameter_mm * 1e-3 - 2 * middle
        plant._press()
        low, high = (middle, high) if plant.normal_n < needed else (low, middle)
    return high


def lift_in_cell(options: CellOptions, ratio: float) -> Lift:
    aperture = options.diameter_mm * 1e-3 - 2 * closure(options, ratio)
    plant = build_plant(options, [0])
    plant.fingers.aperture_m = plant.fingers.target_m = aperture
    for _ in range(round(GRIP_S / CELL_STEP_S)):
        plant.step(CELL_STEP_S)
    before_m = plant.slip_distance_m
    plant.drive_arm(SPEED_M_S, ACCELERATION_M_S2)
    for _ in range(round(LIFT_S / CELL_STEP_S)):
        plant.step(CELL_STEP_S)
    truth = plant.truth(0)
    return Lift(truth.normal_force_n, truth.tangential_force_n, truth.slip_distance_m - before_m)


def lift_in_scene(options: CellOptions, ratio: float) -> Lift:
    way = CLEARANCE_M + closure(options, ratio)
    scene = pipe_scene(options, grip="aperture")
    data, step_s = scene.data, scene.model.opt.timestep
    squeeze, lift = data.actuator("squeeze"), data.actuator("lift")
    begun, speed, height = time.process_time(), 0.0, 0.0
    for _ in range(round(GRIP_S / step_s)):
        squeeze.ctrl = way * min(1.0, 2 * data.time / GRIP_S)
        scene.step()
    # While the pads close, an object that still settles on MuJoCo's table slides between them.
    before_m = sum(fingertip.tip.truth().slip_distance_m for fingertip in scene.fingertips) / 2
    for _ in range(round(LIFT_S / step_s)):
        speed = min(SPEED_M_S, speed + ACCELERATION_M_S2 * step_s)
        height += speed * step_s
        lift.ctrl = height
        scene.step()
    times = (GRIP_S + LIFT_S) / (time.process_time() - begun)
    both = [fingertip.tip.truth() for fingertip in scene.fingertips]
    normal, tangential, slip = (
        sum(getattr(truth, name) for truth in both) / 2
        for name in ("normal_force_n", "tangential_force_n", "slip_distance_m")
    )
    return Lift(normal, tangential, slip - before_m, times)


def main() -> None:
    fidelity = sys.argv[1] if len(sys.argv) > 1 else "winkler"
    print("object          grip  N: cell  scene  slip mm: cell  scene  agree  times real time")
    for name in sys.argv[2:] or CATALOGUE:
        options = CellOptions(object=name, **{**EVEN, "fidelity": fidelity})
        for ratio in (1.5, 0.9):
            cell, scene = lift_in_cell(options, ratio), lift_in_scene(options, ratio)
            slips = abs(scene.slip_m - cell.slip_m) <= max(0.1 * cell.slip_m, 0.5e-3)
            agree = slips and abs(scene.normal_n - cell.normal_n) <= 0.05 * cell.normal_n
            print(
                f"{name:15} {ratio:4} {cell.normal_n:8.3f} {scene.normal_n:6.3f} {cell.slip_m * 1e3:14.2f} "
                f"{scene.slip_m * 1e3:6.2f}  {'yes' if agree else 'NO':5}  {scene.speed:.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
