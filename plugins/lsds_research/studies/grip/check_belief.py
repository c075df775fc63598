"""Compare what the belief says with the truth: `python -m lsds_research.studies.grip.check_belief` (some 4 minutes).

Random objects of the development draws of `fit_normal` are lifted with the default controller. At the end of each lift
that slipped and holds, the friction limit over the load, which decides the grip, is compared with the true ratio of
normal force and needed normal force. The belief is calibrated if its error is one of its stated standard deviations:
two thirds of the objects are within one then, and 95 % within two. The last columns say how much of the error comes
from what is measured: by how much load and normal force, over the true ones, have changed since the object slid.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lsds.cli.threads import one_thread, processes
from lsds.session.run import run
from lsds.support.processes import spread
from lsds_research.metrics import median_and_scatter
from lsds_research.studies.grip.fit_normal import FITTED, OBJECTS, TRIED
from lsds_research.studies.grip.random_objects import drawn

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lsds.contracts import Cycle

LEAST_SLIPPED_M = 3e-4
"""Minimum slip of a lift that counts, m: without one the belief knows only that the limit is greater than the load."""
SLIDES_M_S = 2e-3
"""Minimum true speed of a slide, m/s; chosen."""
END_S = 0.4
"""Time at the end of a lift over which medians are taken, s; chosen."""


class Checked(NamedTuple):
    """Of one lift, natural logarithms: error of limit over load, its stated standard deviation, and by how much the
    errors of load and normal force have changed since the object slid (NaN where the imprint shows no force)."""

    shape: str
    error: float
    stated: float
    load_change: float
    normal_change: float


def checked(which: tuple[int, int]) -> Checked | None:
    """Lift an object (draw, number); return None if it did not slip or was not held."""
    each = drawn(*which)
    seen: list[tuple[float, ...]] = []

    def take(cycle: Cycle) -> None:
        grip = cycle.grip
        seen.append((grip.t_ns, grip.load_n, grip.normal_n, grip.limit_n, grip.limit_std_n))

    session = run(None, each.lift("belief", each.squeeze_mm).overrides(), observe=take)
    truths = session.truths
    if not session.verdict.in_grip or truths[-1].slip_distance_m < LEAST_SLIPPED_M:
        return None
    t_ns, load_n, normal_n, limit_n, std_n = np.array(seen, float).T
    columns = [
        (t.t_ns, t.normal_force_n, t.required_normal_force_n, t.tangential_force_n, math.hypot(*t.slip_velocity_m_s))
        for t in truths
    ]
    at, *rest = np.array(columns, float).T
    true_n, needed_n, pull_n, speed_m_s = (np.interp(t_ns, at, column) for column in rest)
    end = t_ns > t_ns[-1] - END_S * 1e9
    slides = (speed_m_s > SLIDES_M_S) & np.isfinite(limit_n)
    if not slides.any() or not np.isfinite(limit_n[end]).all():
        return None
    believed, true = limit_n[end] / load_n[end], true_n[end] / needed_n[end]
    with np.errstate(divide="ignore"):
        load, normal = np.log(load_n / pull_n), np.log(normal_n / true_n)
    return Checked(
        dict(each.cell)["shape"],
        float(np.median(np.log(believed / true))),
        float(np.median(std_n[end] / limit_n[end])),
        float(np.median(load[end]) - np.median(load[slides])),
        float(np.median(normal[end]) - np.median(normal[slides])),
    )


def lines(found: list[Checked]) -> Iterator[str]:
    """Yield a line for all shapes, and one for each."""
    for shape in ("all", *sorted({each.shape for each in found})):
        rows = [each for each in found if shape in {"all", each.shape}]
        error, stated, load, normal = np.array([each[1:] for each in rows]).T
        within = [f"{np.mean(np.abs(error) <= count * stated):.0%}" for count in (1, 2)]
        yield (
            f"{shape}: {len(rows)} lifts, error {median_and_scatter(error)}, "
            f"stated {np.median(stated):.2f}, within one {within[0]}, within two {within[1]}; "
            f"load since the slide {median_and_scatter(load)}, normal force {median_and_scatter(normal)}"
        )


def main() -> None:
    """Lift, and print how well the belief is calibrated (simulated)."""
    one_thread()
    which = [(draw, index) for draw in (*FITTED, *TRIED) for index in range(OBJECTS)]
    found = [each for _, each in spread(checked, which, processes()) if isinstance(each, Checked)]
    print("belief against truth, natural logarithms (simulated):")
    for line in lines(found):
        print(line)


if __name__ == "__main__":
    main()
