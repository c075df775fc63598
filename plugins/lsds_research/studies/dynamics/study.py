"""A grip is lost for a moment and regained: how far does the object drop, by each scheme and step?"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from lsds_research.studies.dynamics.integrators import (
    GRAVITY_M_S2,
    IN_PRODUCT,
    SCHEMES,
    Motion,
    Scheme,
    Setting,
    return_map,
)

from lsds.contracts.study import StudyResult, Value
from lsds.session.pictures.figure import new_figure

if TYPE_CHECKING:
    from lsds_research.studies.dynamics.options import DynamicsOptions

    from lsds.contracts import BuildContext

STIFFNESS_N_MM = (2.1, 16.0)
HELD_N, LOST_N = 6.0, 0.8
LOST_S, REGAINED_S, END_S = 0.6, 0.76, 1.4
WILD_M = 1.0
"""A drop farther off than this is called unstable."""


class DynamicsStudy:
    """A `Study`."""

    def __init__(self, options: DynamicsOptions, context: BuildContext) -> None:
        self.options = options

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Drop the object by every scheme, stiffness and step."""
        steps = [ms * 1e-3 for ms in self.options.steps_ms]
        rows: list[dict[str, Value]] = []
        whole, done = len(SCHEMES) * len(STIFFNESS_N_MM), 0
        for stiffness in STIFFNESS_N_MM:
            setting = Setting(stiffness_n_m=stiffness * 1e3)
            exact, _ = drop(return_map(1.0), setting, self.options.reference_ms * 1e-3)
            for name, scheme in SCHEMES.items():
                row: dict[str, Value] = {"scheme": name, "stiffness_n_mm": stiffness, "drop_mm": exact * 1e3}
                for step in steps:
                    fallen, created = drop(scheme, setting, step)
                    label = f"{step * 1e3:g} ms"
                    wild = not math.isfinite(fallen) or abs(fallen - exact) > WILD_M
                    row[label] = None if wild else (fallen - exact) * 1e3
                    row[f"created {label}"] = None if wild else created * 1e3
                rows.append(row)
                done += 1
                tick(done, whole)
        columns = [("scheme", "scheme", ""), ("stiffness_n_mm", "N/mm", ".1f")]
        columns += [(f"{s * 1e3:g} ms", f"{s * 1e3:g} ms", "+.2f") for s in steps]
        columns += [(f"created {s * 1e3:g} ms", f"mJ made, {s * 1e3:g} ms", ".2f") for s in steps]
        notes = [
            f"grip {HELD_N:g} N, {LOST_N:g} N from {LOST_S:g} to {REGAINED_S:g} s, then {HELD_N:g} N; "
            "errors of the drop in mm, - where it is unstable; the first two are the plant's"
        ]
        title = "Friction integrators, simulated: error of the drop when a grip is lost and regained"
        return StudyResult(title, columns, rows, partial(_draw, rows=rows, steps=steps), notes)


def drop(scheme: Scheme, setting: Setting, dt_s: float) -> tuple[float, float]:
    """Return how far (m) the object has dropped in the end, and the most energy (J) a step has made."""
    at = Motion(z_m=setting.mass_kg * GRAVITY_M_S2 / setting.stiffness_n_m)
    created, energy = 0.0, _energy(setting, at)
    for k in range(round(END_S / dt_s)):
        t = (k + 0.5) * dt_s
        at = scheme(setting, at, dt_s, LOST_N if LOST_S <= t < REGAINED_S else HELD_N)
        if not math.isfinite(at.y_m) or abs(at.y_m) > 1e3:
            return math.inf, math.inf
        now = _energy(setting, at)
        created, energy = max(created, now - energy), now
    return at.y_m, created


def _energy(s: Setting, at: Motion) -> float:
    return 0.5 * (s.mass_kg * at.v_m_s**2 + s.stiffness_n_m * at.z_m**2) - s.mass_kg * GRAVITY_M_S2 * at.y_m


def _draw(path: Path, rows: list[dict[str, Value]], steps: list[float]) -> None:
    """Write the stability map as PNG: error over step, a panel a stiffness; crosses where a scheme ran away."""
    figure = new_figure(11, 4.6)
    axes = figure.subplots(1, len(STIFFNESS_N_MM), sharey=True)
    for ax, stiffness in zip(axes, STIFFNESS_N_MM, strict=True):
        own = [row for row in rows if row["stiffness_n_mm"] == stiffness]
        for index, row in enumerate(own):
            ours = row["scheme"] in IN_PRODUCT
            errors = [row[f"{s * 1e3:g} ms"] for s in steps]
            known = [(s * 1e3, max(abs(float(e)), 1e-2)) for s, e in zip(steps, errors, strict=True) if e is not None]
            wild = [s * 1e3 for s, e in zip(steps, errors, strict=True) if e is None]
            line = ax.plot(
                [x for x, _ in known],
                [y for _, y in known],
                "o-" if ours else "s--",
                lw=2.5 if ours else 1,
                ms=6 if ours else 4,
                label=str(row["scheme"]),
                color=f"C{index}",
            )[0]
            if wild:
                ax.plot(wild, [WILD_M * 1e3] * len(wild), "x", color=line.get_color(), ms=8)
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.set_xticks([s * 1e3 for s in steps], [f"{s * 1e3:g}" for s in steps])
        ax.minorticks_off()
        ax.set_title(f"{stiffness:g} N/mm, drop {float(own[0]['drop_mm'] or 0):.0f} mm (x: unstable)", fontsize=10)
        ax.set_xlabel("step (ms)")
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("error of the drop (mm)")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right upper", fontsize=8, frameon=False)
    figure.suptitle("A grip is lost and regained, simulated: errors of friction integrators", fontsize=11)
    figure.savefig(path, dpi=110)
