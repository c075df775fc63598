"""Lifts by the whole loop, controller included, in the cell `simulated` and in the cell `mujoco`.

`python -m tests.mocks.fingertip.closed_loop [FIDELITY [OBJECT ...]]` prints slip, steady grip and speed of both, for
all objects of the catalogue unless some are named.
"""

from __future__ import annotations

import sys
import time
from typing import NamedTuple

from lsds_mocks.objects.catalogue import CATALOGUE

import lsds
from lsds.config import load_config

CELLS = ("simulated", "mujoco")


class Loop(NamedTuple):
    """Outcome of a lift, its slip, the normal force at its end, and the speed of the run over real time."""

    outcome: str
    slip_mm: float
    steady_n: float
    speed: float

    def agrees(self, other: Loop) -> tuple[bool, bool]:
        """Return whether slip agrees within 10 % or 0.5 mm, and whether the steady grip agrees within 5 %."""
        return (
            abs(self.slip_mm - other.slip_mm) <= max(0.5, 0.1 * other.slip_mm),
            abs(self.steady_n - other.steady_n) <= 0.05 * other.steady_n,
        )


def lift(cell: str, name: str, fidelity: str) -> Loop:
    begun = time.process_time()
    session = lsds.run(
        load_config(
            None,
            [f"cell.backend={cell}", f"cell.{cell}.object={name}", f"cell.{cell}.fidelity={fidelity}", "clock=virtual"],
        )
    )
    end = session.truths[-1]
    speed = end.t_ns * 1e-9 / (time.process_time() - begun)
    return Loop(str(session.verdict.outcome), 1e3 * session.summary["slip_distance_m"], end.normal_force_n, speed)


def main() -> None:
    fidelity, *names = sys.argv[1:] or ["winkler"]
    agreed = []
    for name in names or CATALOGUE:
        own, other = (lift(cell, name, fidelity) for cell in CELLS)
        agreed.append(other.agrees(own))
        text = ", ".join(
            f"{cell}: {each.outcome}, slip {each.slip_mm:.2f} mm, {each.steady_n:.2f} N, {each.speed:.1f} x real time"
            for cell, each in zip(CELLS, (own, other), strict=True)
        )
        print(f"{name}: {text}", flush=True)
    slips, grips = zip(*agreed, strict=True)
    print(f"slip agrees in {sum(slips)} of {len(slips)}, steady grip in {sum(grips)}")


if __name__ == "__main__":
    main()
