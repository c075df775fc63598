"""Identify the power of the squeeze in the normal force: `python -m lsds_research.studies.grip.fit_power`.

It takes some 3 minutes. Random objects of development draws are grasped and squeezed, and not lifted. The power is the
slope of the true normal force over the true squeeze, both as logarithms, between two squeezes. `grip.power` is that of
contacts that cross the pad or are flat, and `lsds.grip.observer.ROUND_ADDS` is by how much that of round ones is
greater.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lsds.cli.threads import one_thread, processes
from lsds.grip.observer import ROUND_M
from lsds.session.run import run
from lsds.support.processes import spread
from lsds.tactile.contact_size import half_length_of
from lsds_research.metrics import median_and_scatter
from lsds_research.studies.grip.fit_normal import FITTED, LEAST_N, OBJECTS, TRIED
from lsds_research.studies.grip.random_objects import drawn

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lsds.contracts import Cycle

SQUEEZES_M = (1e-3, 3e-3)
"""The two squeezes between which the power is measured, m; chosen: a first squeeze, and a grip that has been closed."""
BEYOND = 1.5
"""Ratio of the squeeze that is asked for to the measured one, because it counts from the noticed touch; chosen."""
ROUND, LONG, FLAT = "round", "long", "flat"
"""Kinds of contacts: one that ends within the pad, one that crosses it, one without a normal force by the imprint."""


class Grown(NamedTuple):
    """Of one object: shape, kind of its contact, and the power with which its normal force grows."""

    shape: str
    kind: str
    power: float


def grown(which: tuple[int, int]) -> Grown | None:
    """Squeeze an object (draw, number) twice; return None if the fingers do not reach the greater squeeze."""
    each = drawn(*which)
    seen: list[tuple[float, bool]] = []

    def take(cycle: Cycle) -> None:
        load = cycle.observation.load
        seen.append((half_length_of(cycle.observation.contact), load is not None and load.normal_n > 0))

    forces_n = []
    for squeeze_m in SQUEEZES_M:
        asked = ("task.lift_s=0.05", "task.hold_s=0.05", f"task.first_squeeze_m={BEYOND * squeeze_m}")
        truths = run(None, (*each.lift("off", each.squeeze_mm).overrides(), *asked), observe=take).truths
        pressed = [(truth.aperture_m, truth.normal_force_n) for truth in truths if truth.normal_force_n > LEAST_N]
        if not pressed:
            return None
        aperture_m, force_n = np.array(pressed).T
        beyond_m = aperture_m.max() - aperture_m
        if beyond_m.max() < squeeze_m:
            return None
        order = np.argsort(beyond_m, kind="stable")
        forces_n.append(float(np.interp(squeeze_m, beyond_m[order], force_n[order])))
        if squeeze_m == SQUEEZES_M[0]:
            half_length_m, known = seen[-1]
    kind = FLAT if not known else ROUND if half_length_m < ROUND_M else LONG
    power = math.log(forces_n[1] / forces_n[0]) / math.log(SQUEEZES_M[1] / SQUEEZES_M[0])
    return Grown(dict(each.cell)["shape"], kind, power)


def lines(found: list[Grown]) -> Iterator[str]:
    """Yield a line for each kind of contact, and one for each shape."""
    for title, column in (("contact", 1), ("shape", 0)):
        for name in sorted({each[column] for each in found}):
            powers = np.array([each.power for each in found if each[column] == name])
            yield f"{title} {name}: {len(powers)} objects, power {median_and_scatter(powers)}"


def main() -> None:
    """Squeeze, and print the powers (simulated)."""
    one_thread()
    which = [(draw, index) for draw in (*FITTED, *TRIED) for index in range(OBJECTS)]
    found = [each for _, each in spread(grown, which, processes()) if isinstance(each, Grown)]
    for line in lines(found):
        print(line)


if __name__ == "__main__":
    main()
