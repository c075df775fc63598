"""Lifts by the whole loop, controller included, in the cell `simulated` and in the cell `mujoco`.

`python -m tests.mocks.fingertip.closed_loop [--fidelity winkler] [--seeds 5] [OBJECT ...]` prints the medians of slip,
steady grip and speed of both over some seeds, for all objects of the catalogue unless some are named. One lift of a
pair says little: frames that differ by a grey level move a closing by a frame, and the grip by a tick of the gripper.
"""

from __future__ import annotations

import argparse
import time
from statistics import median
from typing import NamedTuple

from lsds_mocks.objects.catalogue import CATALOGUE

import lsds
from lsds.config import load_config

CELLS = ("simulated", "mujoco")


class Loop(NamedTuple):
    """Lifts held, medians of slip and of the normal force at the end, and the speed of the runs over real time."""

    held: int
    slip_mm: float
    steady_n: float
    speed: float

    def agrees(self, other: Loop) -> tuple[bool, bool]:
        """Return whether slip agrees within 10 % or 0.5 mm, and whether the steady grip agrees within 5 %."""
        return (
            abs(self.slip_mm - other.slip_mm) <= max(0.5, 0.1 * other.slip_mm),
            abs(self.steady_n - other.steady_n) <= 0.05 * other.steady_n,
        )


def lifts(cell: str, name: str, fidelity: str, seeds: int) -> Loop:
    """Lift an object once for each seed."""
    keys = [f"cell.backend={cell}", f"cell.{cell}.object={name}", f"cell.{cell}.fidelity={fidelity}", "clock=virtual"]
    held, slips_mm, forces_n, simulated_s, begun = 0, [], [], 0.0, time.process_time()
    for seed in range(seeds):
        session = lsds.run(load_config(None, [*keys, f"seed={seed}"]))
        end = session.truths[-1]
        held += session.verdict.outcome == "held"
        slips_mm.append(1e3 * session.summary["slip_distance_m"])
        forces_n.append(end.normal_force_n)
        simulated_s += end.t_ns * 1e-9
    return Loop(held, median(slips_mm), median(forces_n), simulated_s / (time.process_time() - begun))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fidelity", default="winkler")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("objects", nargs="*", default=list(CATALOGUE))
    asked = parser.parse_args()
    agreed = []
    for name in asked.objects:
        own, other = (lifts(cell, name, asked.fidelity, asked.seeds) for cell in CELLS)
        agreed.append(other.agrees(own))
        text = ", ".join(
            f"{cell}: {each.held} of {asked.seeds} held, slip {each.slip_mm:.2f} mm, {each.steady_n:.2f} N, "
            f"{each.speed:.1f} x real time"
            for cell, each in zip(CELLS, (own, other), strict=True)
        )
        print(f"{name}: {text}", flush=True)
    slips, grips = zip(*agreed, strict=True)
    print(f"slip agrees in {sum(slips)} of {len(slips)}, steady grip in {sum(grips)}")


if __name__ == "__main__":
    main()
