"""All stability maps in one run: the safe share of each method, and each map's files in a folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from lsds.cli.output import csv_text, require_writable_folder, write_json, write_text
from lsds.cli.study_output import as_json, drawn
from lsds.contracts.study import StudyResult, Value
from lsds.errors import DataError
from lsds.session.pictures.figure import new_figure
from lsds_research.manifest import STABILITY_MAPS
from lsds_research.stability.plot import NAIVE, SAFE
from lsds_research.stability.study import AREAS, map_named, map_result, measure_all

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds_research.stability.options import AllMapsOptions


class AllMapsStudy:
    """A `Study`."""

    def __init__(self, options: AllMapsOptions, context: BuildContext) -> None:
        self._options, self._seed = options, context.seed

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Measure the maps. Raises DataError for an unknown map, or if nothing could be measured."""
        options = self._options
        if wrong := [name for name in options.maps if name not in STABILITY_MAPS]:
            raise DataError(f"no map {', '.join(wrong)}; there are {', '.join(STABILITY_MAPS)}")
        if options.folder:
            require_writable_folder(Path(options.folder))
        maps = [map_named(name) for name in STABILITY_MAPS if not options.maps or name in options.maps]
        points = {of.name: of.points("quick" if options.quick else "full", self._seed) for of in maps}
        # The points of all maps are shared out together, so that no process waits for the end of a map.
        found, failures = measure_all([each for own in points.values() for each in own], options, tick)
        rows: list[dict[str, Value]] = []
        for of in maps:
            own_failures = {each.key: failures[each.key] for each in points[of.name] if each.key in failures}
            result = map_result(of, points[of.name], found, own_failures, self._seed)
            rows += [{"map": of.name, **area} for area in result.details["areas"]]
            if options.folder:
                _write(Path(options.folder), of.name, result)
        return StudyResult(
            "Safe share of the points of each stability map (simulated)",
            (("map", "map", ""), *AREAS),
            rows,
            partial(plot_overview, rows=rows),
            ["naive methods are known to fail; `lsds study stability-NAME --plot FILE` draws one map"],
            {"failures": failures, "figures_are": "simulated", "seed": self._seed},
            warnings=[f"failed: {name}: {reason}" for name, reason in failures.items()],
        )


def _write(folder: Path, name: str, result: StudyResult) -> None:
    drawn(result, folder / f"{name}.png")
    write_text(csv_text([dict(row) for row in result.rows]), str(folder / f"{name}.csv"))
    write_json(as_json(result), str(folder / f"{name}.json"))


def plot_overview(path: Path, rows: Sequence[dict[str, Value]]) -> None:
    """Write the safe shares as PNG: one bar a method, grouped by map, brown for naive methods."""
    maps = list(dict.fromkeys(str(row["map"]) for row in rows))
    figure = new_figure(8.0, 1.0 + 0.2 * (len(rows) + len(maps)))
    ax = figure.subplots()
    places = [line + maps.index(str(row["map"])) for line, row in enumerate(rows)]
    shares = [float(row["safe"] or 0.0) for row in rows]
    ax.barh(places, shares, 0.7, color=[NAIVE if row["naive"] else SAFE for row in rows])
    for place, share in zip(places, shares, strict=True):
        ax.text(share + 0.01, place, f"{100 * share:.0f} %", va="center", fontsize=6)
    ax.set_yticks(places, [str(row["method"]) for row in rows], fontsize=7)
    for name in maps:
        first = min(place for place, row in zip(places, rows, strict=True) if row["map"] == name)
        ax.text(0.0, first - 1, name, va="center", fontsize=8, fontweight="bold")
    ax.set_ylim(max(places) + 0.7, -1.7)
    ax.set_xlim(0, 1.08)
    ax.set_xlabel("safe share of the points (brown: naive methods)", fontsize=9)
    ax.set_title("Stability maps, simulated", fontsize=10)
    figure.savefig(path, dpi=110)
