"""Speed against accuracy of every gel model on every scene, in one run."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from lsds_mocks.gel.auto.audit import DOTS_M
from lsds_mocks.gel.auto.gel import AutoGel
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.gel.winkler import WinklerGel

from lsds.contracts.study import StudyResult, Value
from lsds.errors import DataError
from lsds_research.studies.gel.plot import draw
from lsds_research.studies.gel.run_scene import Trace, rms_m, timed
from lsds_research.studies.gel.scenes import Scene, named_scenes, random_scene, reference_scenes

if TYPE_CHECKING:
    from lsds_mocks.gel.field.operator import Kernel
    from lsds_mocks.gel.protocol import GelModel
    from numpy.typing import NDArray

    from lsds.contracts import BuildContext
    from lsds_research.studies.gel.options import GelStudyOptions

TOLERANCES_M = (2e-6, 5e-6, 10e-6, 20e-6)
"""Tolerances of the automatic gel that are compared, RMS error of the dots in m; chosen."""
FINEST = 4
"""Refinement factor of the finest grid, whose solution serves as the truth if no reference is given; chosen."""
COLUMNS = (
    ("scene", "scene", ""),
    ("model", "model", ""),
    ("pitch_mm", "grid mm", ".2f"),
    ("us_p50", "us a frame", ".0f"),
    ("us_p99", "p99", ".0f"),
    ("rms_um", "RMS um", ".2f"),
    ("worst_um", "worst frame", ".2f"),
    ("normal_percent", "normal %", ".2f"),
    ("tangential_percent", "tangential %", ".2f"),
    ("stick_percent", "stuck area %", ".1f"),
)
Model = tuple[str, float | None, Callable[[], "GelModel"]]


class GelStudy:
    """A `Study`."""

    timed = ("us_p50", "us_p99")

    def __init__(self, options: GelStudyOptions, context: BuildContext) -> None:
        self.options = options

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Measure all scenes. Raises DataError for an unreadable reference or an unknown scene."""
        scenes = named_scenes(self.options.scenes)
        whole = len(scenes) + self.options.random
        tick(0, whole)
        rows: list[dict[str, Value]] = []
        for done, scene in enumerate(scenes.values(), 1):
            rows += self._measure(scene)
            tick(done, whole)
        chosen: list[dict[str, Value]] = []
        for k in range(self.options.random):
            chosen += choose(random_scene(self.options.seed + k), self.options.repeats)
            tick(len(scenes) + k + 1, whole)
        notes = [verdict(chosen, tolerance) for tolerance in TOLERANCES_M] if chosen else []
        title = "Gel models, simulated: dots' error against time a frame, one thread"
        return StudyResult(title, COLUMNS, rows, partial(draw, rows=rows, chosen=chosen), notes, {"random": chosen})

    def _measure(self, scene: Scene) -> list[dict[str, Value]]:
        truth = self._truth(scene)
        xy = truth["xy_m"]
        rows = []
        for name, pitch, make in models(scene):
            if truth["of"] == name:
                continue
            make()  # compiles and fills tables, which must not count as time of a frame
            trace, us = timed(make, scene, xy, self.options.repeats)
            rows.append(_row(scene, name, pitch, trace, us, truth))
        return rows

    def _truth(self, scene: Scene) -> dict[str, Any]:
        """Return dots, forces and stuck area: from the reference if given, else from the finest grid."""
        if self.options.reference and scene.name in reference_scenes():
            path = Path(self.options.reference) / f"{scene.name}.npz"
            try:
                with np.load(path, allow_pickle=False) as file:
                    return {
                        "of": "reference",
                        "xy_m": file["marker_xy_mm"].astype(float) * 1e-3,
                        "dots_m": file["marker_u_mm"].astype(float).transpose(0, 2, 1) * 1e-3,
                        "forces": np.column_stack(
                            [file["tangential_N"], file["torque_Nmm"] * 1e-3, file["normal_N"]]
                        ).astype(float),
                        "stuck_m2": file["stick_mm2"].astype(float) * 1e-6,
                        "contact_m2": float(file["contact_mm2"][0]) * 1e-6,
                    }
            except (OSError, KeyError, ValueError) as error:
                raise DataError(f"{path}: not a reference solution: {error}") from error
        gel = _field(scene, FINEST, "pad")
        trace, _ = timed(lambda: gel, scene, DOTS_M, 1)
        contact = float(np.count_nonzero(gel.state().pressure_n > 0)) * gel.grid.cell_m2
        return {
            "of": f"pad {gel.grid.pitch_m * 1e3:.2f}",
            "xy_m": DOTS_M,
            "dots_m": trace.dots_m,
            "forces": trace.forces,
            "stuck_m2": trace.stuck_m2,
            "contact_m2": contact,
        }


def _field(scene: Scene, fine: int, kernel: Kernel) -> FieldGel:
    return FieldGel(scene.shape, scene.material, fine=fine, kernel=kernel, follows=scene.follows)


def models(scene: Scene) -> list[Model]:
    """Return all models: name, grid (mm), and factory."""
    found: list[Model] = [
        ("winkler", None, lambda: WinklerGel(scene.shape, scene.material, design_m=scene.indentation_m)),
    ]
    grids: tuple[tuple[Kernel, int], ...] = (("half-space", 2), ("layer", 2), ("pad", 1), ("pad", 2), ("pad", 4))
    for kernel, fine in grids:
        pitch = 0.96 / fine
        found.append((f"{kernel} {pitch:.2f}", pitch, partial(_field, scene, fine, kernel)))
    choosing = [
        (f"auto {tolerance * 1e6:.0f} um", None, partial(_auto, scene, tolerance)) for tolerance in (5e-6, 20e-6)
    ]
    return found + choosing


def _auto(scene: Scene, tolerance_m: float) -> AutoGel:
    return AutoGel(scene.shape, scene.material, tolerance_m=tolerance_m, follows=scene.follows)


def _row(
    scene: Scene, name: str, pitch: float | None, trace: Trace, us: NDArray[np.float64], truth: dict[str, Any]
) -> dict[str, Value]:
    rms, worst = rms_m(trace, truth["dots_m"])
    normal, pull = truth["forces"][:, 3], truth["forces"][:, :2]
    most = float(np.abs(pull).max())
    return {
        "scene": scene.name,
        "model": name,
        "pitch_mm": pitch,
        "us_p50": float(np.median(us)),
        "us_p99": float(np.quantile(us, 0.99)),
        "rms_um": rms * 1e6,
        "worst_um": worst * 1e6,
        "normal_percent": 100 * float(np.abs(trace.forces[:, 3] / normal - 1).max()),
        "tangential_percent": (100 * float(np.abs(trace.forces[:, :2] - pull).max()) / most if most > 1e-3 else None),
        "stick_percent": 100 * float(np.abs(trace.stuck_m2 - truth["stuck_m2"])[1:].max()) / truth["contact_m2"],
        "truth": truth["of"],
    }


def choose(scene: Scene, repeats: int) -> list[dict[str, Value]]:
    """Return, for each tolerance, error and cost of the gel with automatic grid, compared with the cheapest sufficient
    grid."""
    fixed: dict[int, tuple[Trace, float]] = {}
    for fine in (1, 2, 4):
        trace, us = timed(
            partial(_field, scene, fine, "pad"), scene, DOTS_M, repeats if fine < FINEST else min(repeats, 2)
        )
        fixed[fine] = trace, float(us.sum(axis=1).min())
    truth = fixed[4][0].dots_m
    rows: list[dict[str, Value]] = []
    for tolerance in TOLERANCES_M:
        best = next((f for f in fixed if rms_m(fixed[f][0], truth)[0] <= tolerance), 4)
        gels: list[AutoGel] = []

        def make(tolerance: float = tolerance, gels: list[AutoGel] = gels) -> AutoGel:
            gels.append(_auto(scene, tolerance))
            return gels[-1]

        trace, us = timed(make, scene, DOTS_M, repeats)
        rms, _ = rms_m(trace, truth)
        report = gels[-1].report()
        rows.append(
            {
                "scene": scene.name,
                "tolerance_um": tolerance * 1e6,
                "rms_um": rms * 1e6,
                "met": rms <= tolerance,
                "best_mm": 0.96 / best,
                "chosen_mm": report.pitch_m * 1e3,
                "audits": report.audits,
                "cost_ratio": float(us.sum(axis=1).min()) / fixed[best][1],
                "frames": len(scene.frames),
            }
        )
    return rows


def verdict(chosen: list[dict[str, Value]], tolerance_m: float) -> str:
    """Return how often a tolerance was met, and at what cost."""
    rows = [row for row in chosen if row["tolerance_um"] == tolerance_m * 1e6]
    met = sum(bool(row["met"]) for row in rows)
    ratio = float(np.median([float(row["cost_ratio"] or 0) for row in rows]))
    return (
        f"auto, {tolerance_m * 1e6:.0f} um: met in {met} of {len(rows)} random scenes, "
        f"at a median of {ratio:.2f} times the cheapest grid that meets it"
    )
