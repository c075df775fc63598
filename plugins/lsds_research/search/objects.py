"""The space of random objects as axes: what a stranger may put between the fingers, from no catalogue.

A failure with an object that no firm grip holds is not a failure of the controller.

The ranges are those of the study `grip` (`lsds_research.studies.grip.random_objects`). Some keys depend on others: a
sphere is as long as it is thick, and kinetic friction is a share of the static one.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from lsds.config.overrides import override_texts
from lsds.errors import DataError
from lsds_research.search.space import DEFAULT, Axis, Scenario, read_space
from lsds_research.studies.grip.random_objects import (
    FIRM_SQUEEZES_MM,
    FRICTION_RANGE,
    GRAIN_UM,
    KINETIC_SHARE,
    LIFT_SPEED_RANGE_M_S,
    MASS_KG,
    SHAPES,
    SQUEEZE_MM,
    STIFFNESS_N_MM,
    TEXTURES,
    THICKNESS_MM,
)

CELL = "cell.simulated."
SHARE = "kinetic_share"
"""Axis that is no config key: kinetic over static friction."""
OBJECTS = (
    Axis(f"{CELL}shape", choices=SHAPES, usual="cylinder"),
    Axis(f"{CELL}diameter_mm", *THICKNESS_MM, usual=25.0),
    Axis(f"{CELL}length_mm", 60.0, 220.0, usual=150.0),
    Axis(f"{CELL}width_mm", 8.0, 100.0, usual=60.0),
    Axis(f"{CELL}edge_mm", 0.3, 4.0, usual=1.0),
    Axis(f"{CELL}turned_deg", -30.0, 30.0, usual=0.0),
    Axis(f"{CELL}texture", choices=TEXTURES, usual="smooth"),
    Axis(f"{CELL}texture_size_mm", 0.5, 4.0, usual=1.0),
    Axis(f"{CELL}texture_depth_mm", 0.02, 0.2, usual=0.05),
    Axis(f"{CELL}grain_um", *GRAIN_UM, usual=5.0),
    Axis(f"{CELL}mass_kg", *MASS_KG, usual=0.3),
    Axis(f"{CELL}stiffness_n_mm", *STIFFNESS_N_MM, usual=1000.0),
    Axis(f"{CELL}static_friction", *FRICTION_RANGE, usual=0.55),
    Axis(SHARE, *KINETIC_SHARE, usual=0.82),
    Axis(f"{CELL}texture_amplitude", 0.0, 0.15, usual=0.08),
    Axis(f"{CELL}chatter_amplitude", 0.1, 0.4, usual=0.25),
    Axis("sensor.mock-gelsight-mini.gel", 1, 1000, usual=1, whole=True),
    Axis("task.first_squeeze_m", SQUEEZE_MM[0] * 1e-3, SQUEEZE_MM[1] * 1e-3, usual=1e-3),
    Axis("task.lift_speed_m_s", *LIFT_SPEED_RANGE_M_S, usual=0.038),
    Axis("seed", 0, 1000, usual=0, whole=True),
)

FIRM = tuple(
    tuple(override_texts({"controller.enabled": False, "task.first_squeeze_m": squeeze_mm * 1e-3}))
    for squeeze_mm in FIRM_SQUEEZES_MM
)
"""Config keys of each lift with a firm grip."""


class Space(NamedTuple):
    """Axes of scenarios, config keys of lifts with a firm grip, and a function that adds keys that depend on others."""

    axes: tuple[Axis, ...]
    firm: tuple[tuple[str, ...], ...] = ()
    complete: Callable[[Scenario], Scenario] = dict


def chosen_space(file: str, *, random: bool) -> Space:
    """Return the space of a file, that of random objects, or the default. Raises DataError."""
    if not random:
        return Space(read_space(Path(file)) if file else DEFAULT)
    if file:
        raise DataError(f"--space {file} and --random are two spaces: leave one out")
    return Space(OBJECTS, FIRM, completed)


def completed(scenario: Scenario) -> Scenario:
    """Return a scenario with the keys that depend on others."""
    found = dict(scenario)
    share, static = found.pop(SHARE, None), f"{CELL}static_friction"
    # Of a pair of which one is drawn, the other has its usual value.
    if share is not None or static in found:
        friction, part = float(found.get(static, _usual(static))), float(_usual(SHARE) if share is None else share)
        found[static], found[f"{CELL}kinetic_friction"] = friction, round(friction * part, 4)
    if found.get(f"{CELL}shape") == "sphere":
        diameter_mm = float(found.get(f"{CELL}diameter_mm", _usual(f"{CELL}diameter_mm")))
        found[f"{CELL}diameter_mm"], found[f"{CELL}length_mm"] = diameter_mm, max(20.0, diameter_mm)
        found[f"{CELL}turned_deg"] = 0.0
    if found.get(f"{CELL}texture") == "smooth":
        found[f"{CELL}texture_depth_mm"] = 0.0
    if f"{CELL}length_mm" in found:
        found[f"{CELL}grip_height_mm"] = min(50.0, float(found[f"{CELL}length_mm"]) / 2)
    if "task.lift_speed_m_s" in found:
        # As high as the arm can reach, whatever the speed, as in the study of grip.
        found["task.lift_s"] = round(min(3.0, 0.12 / float(found["task.lift_speed_m_s"])), 3)
    return found


def _usual(key: str) -> float:
    """Return the usual value of an axis."""
    return float(next(axis.usual for axis in OBJECTS if axis.key == key))
