"""The study of one map: every method at every point, its safe area, and the picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

from lsds.contracts.study import StudyResult, StudyTable, Value
from lsds.errors import DataError, LsdsError
from lsds_research.manifest import STABILITY_MAPS
from lsds_research.run_store import run_and_store
from lsds_research.stability.grid import Grid, Point, StabilityMap, area, worst
from lsds_research.stability.plot import plot_map

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds_research.stability.options import PointOptions, StabilityOptions

    Row = dict[str, Any]

AREAS = (("method", "method", ""), ("naive", "naive", ""), ("safe", "safe share", ".3f"), ("points", "points", "d"))


class StabilityStudy:
    """A `Study`."""

    def __init__(self, map_of: StabilityMap, options: StabilityOptions, context: BuildContext) -> None:
        self._map, self._options, self._seed = map_of, options, context.seed

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Measure the map. Raises DataError for an unknown method, or if no point could be measured."""
        options, of = self._options, self._map
        if wrong := [name for name in options.methods if name not in (*of.methods, *of.naive)]:
            raise DataError(f"no method {', '.join(wrong)}; there are {', '.join((*of.methods, *of.naive))}")
        points = of.points("quick" if options.quick else "full", self._seed, options.methods)
        return map_result(of, points, *measure_all(points, options, tick), self._seed)


def measure_all(
    points: Sequence[Point], options: PointOptions, tick: Callable[[int, int], None]
) -> tuple[dict[str, Row], dict[str, str]]:
    """Return the figures of points by key, and the reasons of failures. Raises DataError if all failed."""
    found, failures = run_and_store(measured, points, options.out, options.jobs, options.cluster, tick)
    if not found:
        raise DataError(f"nothing could be measured; the first: {next(iter(failures.values()))}")
    return found, failures


def map_result(
    of: StabilityMap, points: Sequence[Point], found: dict[str, Row], failures: dict[str, str], seed: int
) -> StudyResult:
    """Return table, safe areas and picture of a map. A point that could not be measured does not pass."""
    rows = summarized(of, points, found | {each.key: {"figure": None} for each in points if each.key not in found})
    areas = safe_areas(of, rows)
    columns = (
        ("method", "method", ""),
        ("x", of.x.label, ".4g"),
        ("y", of.y.label, ".4g"),
        ("figure", f"{of.figure}{', ' + of.unit if of.unit else ''}", ".3g"),
        ("passes", "passes", ""),
    )
    remarks = of.remarks() if of.remarks is not None else ()
    return StudyResult(
        f"{of.title} (simulated)",
        columns,
        rows,
        partial(plot_map, of=of, rows=rows),
        [f"a point passes with {of.figure} up to {of.limit:g} {of.unit}".rstrip(), *of.notes, *remarks],
        {"areas": areas, "limit": of.limit, "failures": failures, "figures_are": "simulated", "seed": seed},
        [StudyTable(AREAS, areas)],
        warnings=[f"failed: {name}: {reason}" for name, reason in failures.items()],
    )


def measured(point: Point) -> Row | str:
    """Measure a point; return its figure, or the reason of a failure."""
    try:
        figure = map_named(point.map).measure(point.method, point.x, point.y, point.seed)
    except LsdsError as error:
        return f"{point.key}: {error}"
    return {"figure": float(figure) if math.isfinite(figure) else None}


def map_named(name: str) -> StabilityMap:
    """Return a map by its name in `STABILITY_MAPS`."""
    found: StabilityMap = import_module(f"lsds_research.stability.maps.{STABILITY_MAPS[name].module}").MAP
    return found


def summarized(of: StabilityMap, points: Sequence[Point], found: dict[str, Row]) -> list[dict[str, Value]]:
    """Return a row for each method and place: the worst figure over the seeds, None if it is infinite."""
    places: dict[tuple[str, float, float], list[float]] = {}
    for point in points:
        if point.key in found:
            figure = found[point.key]["figure"]
            places.setdefault((point.method, point.x, point.y), []).append(math.inf if figure is None else figure)
    rows: list[dict[str, Value]] = []
    for (method, x, y), figures in places.items():
        most = worst(figures)
        passes = most <= of.limit
        rows.append(
            {"method": method, "x": x, "y": y, "figure": most if math.isfinite(most) else None, "passes": passes}
        )
    return rows


def safe_areas(of: StabilityMap, rows: Sequence[dict[str, Value]]) -> list[dict[str, Value]]:
    """Return the safe share of the points of each method."""
    found: list[dict[str, Value]] = []
    for method in (*of.methods, *of.naive):
        passes = [bool(row["passes"]) for row in rows if row["method"] == method]
        if passes:
            naive = method in of.naive
            found.append({"method": method, "naive": naive, "safe": area(passes), "points": len(passes)})
    return found


def areas_on(of: StabilityMap, grid: Grid, seed: int = 0) -> dict[str, float]:
    """Measure a grid in this process; return the safe share of each method."""
    points = of.points(grid, seed)
    found: dict[str, Row] = {}
    for point in points:
        row = measured(point)
        if isinstance(row, str):
            raise DataError(row)
        found[point.key] = row
    return {str(row["method"]): float(row["safe"] or 0) for row in safe_areas(of, summarized(of, points, found))}
