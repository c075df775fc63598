"""Draw docs/images/lift.png, the belief during one lift, step by step: `python docs/one_lift.py` (needs the extra sim).

The lift is the default one, that of `lsds run`. The squares show the belief over load and friction limit at the
squeeze of that moment; the curves show what follows from it, and the truth of the simulated cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from lsds_plugins.controllers.belief import BeliefOptions

import lsds
from lsds.config import load_config

if TYPE_CHECKING:
    from numpy.typing import NDArray

PICTURE = Path(__file__).resolve().parent / "images" / "lift.png"
DRAWN_N = (0.1, 10.0)
"""Range of load and friction limit that is drawn, N."""
MARGIN = BeliefOptions().margin


@dataclass(frozen=True)
class Round:
    """A round of the belief, and the truth at its time."""

    t_s: float
    grip: Any
    commanded_mm: float
    stick: NDArray[np.float64]
    slide: NDArray[np.float64]
    normal_n: float
    needed_n: float
    slip_m_s: float


def rounds() -> tuple[list[Round], NDArray[np.float64], NDArray[np.float64]]:
    """Return the rounds of the default lift, and the loads (N) and limits (N/mm^p) of the belief's grid."""
    seen = []
    with lsds.bring_up() as engine:
        belief, cell = engine._grip.belief, engine.rig.own_cell
        assert cell is not None
        for cycle in engine:
            grip, truth = cycle.grip, cell.truth()
            if not (grip.complete and math.isfinite(grip.squeeze_m)):
                continue
            commanded_m = grip.touch_m - (grip.commanded_m if cycle.command_m is None else cycle.command_m)
            seen.append(
                Round(
                    cycle.t_ns * 1e-9,
                    grip,
                    1e3 * commanded_m,
                    belief.stick.copy(),
                    belief.slide.copy(),
                    truth.normal_force_n,
                    truth.required_normal_force_n,
                    math.hypot(*truth.slip_velocity_m_s),
                )
            )
        return seen, belief.load_n, belief.limit


def moments(seen: list[Round]) -> list[int]:
    """Return the rounds that are explained: before the load, the surest slide, the greatest squeeze, the end."""
    surest = max(range(len(seen)), key=lambda k: seen[k].grip.slips)
    widest = max(seen[k].grip.squeeze_m for k in range(len(seen)))
    firmest = [k for k in range(len(seen)) if seen[k].grip.squeeze_m > widest - 1e-5]
    opened = next(k for k in range(firmest[-1], len(seen)) if seen[k].grip.squeeze_m < widest - 3e-4)
    return [0, surest, firmest[len(firmest) // 2], min(opened + 3, len(seen) - 1)]


def draw() -> None:
    """Run the lift and write the picture."""
    from matplotlib.figure import Figure

    power = load_config().grip.power
    seen, loads, limits = rounds()
    at = moments(seen)
    began_s = seen[0].t_s
    end = at[-1] + 6
    t = np.array([each.t_s - began_s for each in seen[:end]])
    figure = Figure(figsize=(11, 10.5), layout="constrained")
    grid = figure.add_gridspec(4, 4, height_ratios=(2.6, 1.6, 1.9, 1.3))
    for column, k in enumerate(at):
        _square(figure.add_subplot(grid[0, column]), seen[k], column + 1, t[k], loads, limits, power)
    squeeze, force, chance = (figure.add_subplot(grid[row, :]) for row in (1, 2, 3))
    squeeze.step(t, [each.commanded_mm for each in seen[:end]], where="post", color="tab:orange", label="commanded")
    squeeze.plot(t, [1e3 * each.grip.squeeze_m for each in seen[:end]], color="tab:blue", label="measured")
    squeeze.set_ylabel("squeeze, mm")
    grips = [each.grip for each in seen[:end]]
    limit, std = np.array([g.limit_n for g in grips]), np.array([g.limit_std_n for g in grips])
    # The measured load is right to a factor of the object's contact: the truth is drawn in the same units.
    hangs_n = float(np.median([each.grip.load_n for each in seen[-20:]]))
    force.fill_between(t, limit - std, limit + std, color="tab:green", alpha=0.25, lw=0)
    force.plot(t, limit, color="tab:green", label="friction limit, believed, ± one standard deviation")
    true = [hangs_n * each.normal_n / each.needed_n for each in seen[:end]]
    force.plot(t, true, color="black", ls="--", lw=1, label="friction limit, true (simulated)")
    force.plot(t, [g.load_n for g in grips], color="tab:purple", label="load, measured")
    force.set_ylim(0, 1.15 * max(true))
    force.set_ylabel("a finger, N")
    chance.plot(t, [g.slips for g in grips], color="tab:red", label="P(slide)")
    slides = [each.slip_m_s > 0 for each in seen[:end]]
    chance.fill_between(
        t, 0, 1, where=slides, step="mid", color="0.75", lw=0, label="slides (simulated truth)", zorder=0
    )
    chance.set_ylabel("probability")
    chance.set_xlabel("time since the arm rises, s")
    for panel in (squeeze, force, chance):
        panel.set_xlim(t[0], t[-1])
        panel.grid(alpha=0.3)
        panel.legend(fontsize=8, loc="best", framealpha=0.9)
        for column, k in enumerate(at):
            panel.axvline(t[k], color="0.4", lw=0.8, zorder=0)
            if panel is squeeze:
                panel.annotate(
                    str(column + 1), (t[k], 1.02), xycoords=("data", "axes fraction"), ha="center", fontsize=11
                )
    figure.savefig(PICTURE, dpi=110)


def _square(
    panel: Any,
    now: Round,
    number: int,
    t_s: float,
    loads: NDArray[np.float64],
    limits: NDArray[np.float64],
    power: float,
) -> None:
    """Draw the belief over load and friction limit at the squeeze of a moment: stick in blue, slide in red."""
    at_squeeze = limits * (1e3 * now.grip.squeeze_m) ** power
    peak = max(now.stick.max(), now.slide.max())
    image = np.ones((len(loads), len(limits), 3))
    for mass, colour in ((now.stick, (0.12, 0.47, 0.71)), (now.slide, (0.84, 0.15, 0.16))):
        share = np.sqrt(mass / peak)[:, :, None]
        image = image * (1 - share * (1 - np.array(colour)))
    panel.pcolormesh(at_squeeze, loads, image, shading="nearest")
    panel.plot(DRAWN_N, DRAWN_N, color="black", lw=0.8)
    panel.plot(DRAWN_N, np.array(DRAWN_N) / MARGIN, color="black", lw=0.8, ls=":")
    panel.set(xscale="log", yscale="log", xlim=DRAWN_N, ylim=DRAWN_N, aspect="equal")
    panel.set_title(f"{number}: {t_s:.2f} s, P(slide) = {now.grip.slips:.2f}", fontsize=10)
    panel.set_xlabel("friction limit, N")
    if number == 1:
        panel.set_ylabel("load W that will come, N")
    panel.text(0.13, 7.5, "slips", fontsize=9, va="top")
    panel.text(8, 0.13, "holds", fontsize=9, ha="right")


if __name__ == "__main__":
    draw()
