"""A lift of the simulated cell at a point of a map, for each controller and for a fixed grip."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from lsds.config.overrides import override_texts
from lsds.errors import DataError
from lsds_research.stability.grid import Axis, Curve, StabilityMap
from lsds_research.studies.grip.lift import OFF, Lift, lift, weight_n

CONTROLLERS = ("belief", "pd")
FIXED = "fixed grip"
"""The naive method: the first squeeze, without a controller."""
FIRM = "firm grip"
"""A fixed grip of 6 mm: it shows which points are physically possible."""
FIRM_SQUEEZE_MM = 6.0
"""Squeeze of the firm grip, mm; chosen."""
FIRM_NOTE = f"a fixed grip of {FIRM_SQUEEZE_MM:g} mm shows which points are physically possible"
SLIP_LIMIT_MM = 12.0
"""Accepted slip of a lift: that of 95 % of the random objects (mm)."""
GRIP_LIMIT = 3.0
"""Accepted greatest normal force, in units of the needed one."""


def lifted(
    method: str,
    seed: int,
    settings: dict[str, Any],
    *,
    squeeze_mm: float = 1.1,
    name: str = "pvc-pipe",
    cell: dict[str, Any] | None = None,
    speed_m_s: float = 0.038,
) -> dict[str, Any]:
    """Run a lift; return its figures. Raises DataError if the run could not be made.

    `settings` are keys of the config, `cell` keys of an object that is not in the catalogue.
    """
    backend = OFF if method in (FIXED, FIRM) else method
    squeeze_mm = FIRM_SQUEEZE_MM if method == FIRM else squeeze_mm
    what = Lift(
        backend,
        name,
        squeeze_mm,
        speed_m_s,
        1.0,
        "none",
        seed,
        weight_n(name),
        settings=tuple(override_texts(settings)),
        cell=tuple(override_texts(cell or {})),
    )
    found = lift(what)
    if isinstance(found, str):
        raise DataError(found)
    return found


def slip_map(
    name: str,
    title: str,
    x: Axis,
    y: Axis,
    measure: Callable[[str, float, float, int], float],
    *,
    firm: bool = False,
    notes: tuple[str, ...] = (),
    remarks: Callable[[], Sequence[str]] | None = None,
    curves: Callable[[], Sequence[Curve]] | None = None,
) -> StabilityMap:
    """Return a map of the slip of a lift, for the controllers and the fixed grip; `firm`: for the firm grip, too."""
    return StabilityMap(
        name,
        title,
        x,
        y,
        CONTROLLERS,
        (FIXED, FIRM) if firm else (FIXED,),
        "slip",
        "mm",
        SLIP_LIMIT_MM,
        measure,
        notes=((FIRM_NOTE,) if firm else ()) + notes,
        remarks=remarks,
        curves=curves,
    )


def slip_mm(found: dict[str, Any]) -> float:
    """Return the slip of a lift (mm); infinity if the object was not held."""
    return float(found["slip_mm"]) if found["held"] else math.inf


def peak(found: dict[str, Any]) -> float:
    """Return the greatest normal force over the needed one; infinity if the object was not held."""
    return float(found["peak_over_needed"]) if found["held"] else math.inf
