"""Sensitivity to the parameters of the grip: each at 0.7 and 1.3 times its value, on the same lifts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from annotated_types import Ge, Gt, Le, Lt

from lsds.config import load_config
from lsds.config.overrides import override_texts
from lsds.registry.host import PluginHost

if TYPE_CHECKING:
    from pydantic import BaseModel

    from lsds_research.studies.grip.lift import Lift

    Row = dict[str, Any]

OPTION_FACTORS = (0.7, 1.3)
"""Factors by which each parameter is multiplied, one at a time; chosen."""
INSIDE = 1e-3
"""A value beyond an open bound is moved inside it by this share of the parameter."""
COLUMNS = (
    ("parameter", "parameter", ""),
    ("value", "value", ".3g"),
    ("runs", "runs", "d"),
    ("held", "held", ".3f"),
    ("lost", "lost, gained", ""),
    ("slip_mm", "slip, mm", ".1f"),
    ("slip_95_mm", "95 %", ".1f"),
    ("peak", "peak/needed", ".2f"),
    ("peak_95", "95 %", ".2f"),
    ("steady", "steady/needed", ".2f"),
    ("steady_95", "95 %", ".2f"),
    ("grew", "grown where it held", ".3f"),
)
EXPLAINED = (
    "each parameter alone at 0.7 and 1.3 times its value, or at its bound; lost, gained: lifts that are held with the "
    "defaults and not with this value, and the other way round"
)


def variants(controller: str, settings: Sequence[str]) -> list[tuple[str, float, str]]:
    """Return name, value and override of each variant of the parameters in `[grip]` and of a controller's options."""
    host = PluginHost()
    config = load_config(None, [f"controller.backend={controller}", *settings], host=host)
    tables: list[tuple[str, BaseModel]] = [("grip", config.grip)]
    options = host.options_model(host.find("controller", controller))
    if options is not None:
        name = controller.rpartition(":")[2]
        tables.append((f"controller.{name}", options(**config.section("controller").options())))
    return [variant for table, values in tables for variant in _of(table, values)]


def _of(table: str, values: BaseModel) -> list[tuple[str, float, str]]:
    found: list[tuple[str, float, str]] = []
    for name, field in type(values).model_fields.items():
        now = getattr(values, name)
        if not isinstance(now, float) or now == 0:
            continue
        others = sorted({_inside(factor * now, now, field.metadata) for factor in OPTION_FACTORS} - {now})
        key = f"{table}.{name}"
        found.extend((key, value, override_texts({key: value})[0]) for value in others)
    return found


def _inside(value: float, now: float, bounds: Sequence[Any]) -> float:
    """Return a value, moved into the bounds of its field."""
    for bound in bounds:
        if isinstance(bound, Ge):
            value = max(value, float(bound.ge))  # type: ignore[arg-type]
        elif isinstance(bound, Gt):
            value = max(value, float(bound.gt) + INSIDE * now)  # type: ignore[arg-type]
        elif isinstance(bound, Le):
            value = min(value, float(bound.le))  # type: ignore[arg-type]
        elif isinstance(bound, Lt):
            value = min(value, float(bound.lt) - INSIDE * now)  # type: ignore[arg-type]
    return float(f"{value:.6g}")


def varied(lifts: Sequence[Lift], variant: str) -> list[Lift]:
    """Return the same lifts with another value of a parameter."""
    return [replace(what, settings=(*what.settings, variant)) for what in lifts]


def table(
    rows: Sequence[Row],
    names: Sequence[tuple[str, float, str]],
    summary: Callable[[Sequence[Row]], Row],
) -> list[Row]:
    """Return a row for the defaults and for each variant, from the rows of all lifts."""
    plain = [row for row in rows if not _variant(row, names)]
    held = {_lift(row): row["held"] for row in plain}
    found = [{"parameter": "as it is", "value": None, "lost": "", **summary(plain)}]
    for name, value, text in names:
        own = [row for row in rows if _variant(row, names) == text]
        lost = sum(held.get(_lift(row), False) and not row["held"] for row in own)
        gained = sum(row["held"] and not held.get(_lift(row), True) for row in own)
        found.append({"parameter": name, "value": value, "lost": f"{lost}, {gained}", **summary(own)})
    return found


def _variant(row: Row, names: Sequence[tuple[str, float, str]]) -> str:
    texts = {text for _, _, text in names}
    return next((text for text in row["settings"] if text in texts), "")


def _lift(row: Row) -> tuple[Any, ...]:
    return tuple(row[name] for name in ("object", "squeeze_mm", "speed_m_s", "friction", "change", "seed"))
