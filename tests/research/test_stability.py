"""Stability maps: grids, figures, and stored safe areas that must not shrink."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from lsds_research.manifest import STABILITY_MAPS as MAPS
from lsds_research.stability.grid import Axis, StabilityMap, worst
from lsds_research.stability.options import AllMapsOptions, StabilityOptions
from lsds_research.stability.overview import AllMapsStudy
from lsds_research.stability.plot import plot_map
from lsds_research.stability.study import StabilityStudy, areas_on, map_named

from lsds.cli.main import main
from lsds.clock import VirtualClock
from lsds.config import load_config
from lsds.contracts import BuildContext
from lsds.errors import DataError

STORED = json.loads(resources.files("lsds_research.stability").joinpath("areas.json").read_text(encoding="utf-8"))
QUICK = ("integrators", "marker-travel", "markers-lost")


def a_map(measure, **others):
    axis = Axis("x", "mm", (1.0, 2.0, 3.0, 4.0), (1.0, 4.0), (1.0,))
    name = others.pop("name", "made")
    named = {"limit": 2.5, "measure": measure, **others}
    return StabilityMap(name, "Made", axis, axis, ("good",), ("naive",), "error", "mm", **named)


def result(of, **options):
    study = StabilityStudy(of, StabilityOptions(**options, jobs=1), BuildContext(VirtualClock(), seed=3))
    return study.run(lambda done, total: None)


@pytest.fixture
def made(monkeypatch):
    """A map whose good method has the greater coordinate as its figure, and whose naive method diverges beyond 1."""
    of = a_map(lambda method, x, y, seed: max(x, y) if method == "good" or max(x, y) == 1 else math.inf)
    monkeypatch.setattr("lsds_research.stability.study.map_named", lambda name: of)
    return of


def test_a_map_marks_what_fails_and_states_the_safe_share(made, tmp_path):
    found = result(made)
    areas = {row["method"]: row["safe"] for row in found.details["areas"]}
    assert areas == {"good": 4 / 16, "naive": 1 / 16}
    failing = [row for row in found.rows if row["method"] == "naive" and not row["passes"]]
    assert len(failing) == 15
    assert all(row["figure"] is None for row in failing)
    found.draw(tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 5000


def test_a_point_that_cannot_be_measured_does_not_pass(monkeypatch):
    def measure(method, x, y, seed):
        if x > 2.5:
            raise DataError("no measurement")
        return 1.0

    of = a_map(measure)
    monkeypatch.setattr("lsds_research.stability.study.map_named", lambda name: of)
    found = result(of)
    assert {row["method"]: (row["safe"], row["points"]) for row in found.details["areas"]} == {
        "good": (8 / 16, 16),
        "naive": (8 / 16, 16),
    }
    assert found.warnings


def test_a_quick_grid_and_single_methods_measure_less(made):
    assert len(result(made, quick=True).rows) == 8
    assert {row["method"] for row in result(made, methods=["naive"]).rows} == {"naive"}
    with pytest.raises(DataError, match="no method other; there are good, naive"):
        result(made, methods=["other"])


def test_the_worst_seed_counts(monkeypatch):
    of = a_map(lambda method, x, y, seed: float(seed), seeds={"full": 3, "quick": 1, "check": 1})
    monkeypatch.setattr("lsds_research.stability.study.map_named", lambda name: of)
    assert {row["figure"] for row in result(of).rows} == {5.0}
    assert worst([1.0, math.nan]) == math.inf


def all_maps(**options):
    study = AllMapsStudy(AllMapsOptions(**options, jobs=1), BuildContext(VirtualClock(), seed=3))
    return study.run(lambda done, total: None)


def test_all_maps_in_one_run_state_their_safe_shares_and_write_each_map(monkeypatch, tmp_path):
    def made_as(name):
        limit = 2.5 if name == "spheres" else 1.5
        return a_map(lambda method, x, y, seed: max(x, y) if method == "good" else math.inf, name=name, limit=limit)

    for module in ("study", "overview"):
        monkeypatch.setattr(f"lsds_research.stability.{module}.map_named", made_as)
    found = all_maps(maps=["spheres", "edge"], folder=str(tmp_path / "maps"))
    assert {(row["map"], row["method"]): row["safe"] for row in found.rows} == {
        ("spheres", "good"): 4 / 16,
        ("spheres", "naive"): 0,
        ("edge", "good"): 1 / 16,
        ("edge", "naive"): 0,
    }
    written = {f"{name}.{kind}" for name in ("spheres", "edge") for kind in ("png", "csv", "json")}
    assert {file.name for file in (tmp_path / "maps").iterdir()} == written
    assert json.loads((tmp_path / "maps/edge.json").read_text())["areas"][0]["safe"] == 1 / 16
    found.draw(tmp_path / "all.png")
    assert (tmp_path / "all.png").stat().st_size > 5000
    assert {row["map"] for row in all_maps().rows} == set(MAPS)
    with pytest.raises(DataError, match="no map other; there are marker-travel"):
        all_maps(maps=["other"])
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="cannot be written"):
        all_maps(maps=["edge"], folder=str(tmp_path / "file"))


def test_the_maps_may_be_written_to_a_folder_that_is_there(tmp_path, installed_host):
    """It was refused as one that is no file, so a command that was repeated failed."""
    asked = ["study", "stability", "--quick", "--map", "turning", "--jobs", "1", "--no-plot", "--folder", str(tmp_path)]
    assert main(asked) == 0
    assert main(asked) == 0
    assert {file.name for file in tmp_path.iterdir()} == {"turning.png", "turning.csv", "turning.json"}


def test_the_stable_delay_of_the_linear_loop_is_drawn_beyond_the_edge_of_its_map(tmp_path):
    pytest.importorskip("control", reason="python-control is not installed: pip install control")
    of = map_named("loop-delay")
    ((about, _, points),) = of.curves()
    assert about == "pd"
    assert all(delay_ms < of.x.full[0] for delay_ms, _ in points)
    rows = [
        {"method": "pd", "x": x, "y": y, "figure": 0.05 * x, "passes": 0.05 * x <= of.limit}
        for x in of.x.full
        for y in of.y.full
    ]
    plot_map(tmp_path / "with.png", of, rows)
    plot_map(tmp_path / "without.png", replace(of, curves=None), rows)
    assert (tmp_path / "with.png").read_bytes() != (tmp_path / "without.png").read_bytes()


@pytest.mark.parametrize("name", MAPS)
def test_every_map_is_complete(name):
    of = map_named(name)
    assert of.name == name
    assert of.naive, "a map shows a method that fails"
    assert set(STORED[name]) == {*of.methods, *of.naive}
    for axis in (of.x, of.y):
        assert set(axis.check) | set(axis.quick) <= {*np.round(axis.full, 6), *axis.check, *axis.quick}
        assert list(axis.full) == sorted(axis.full)


def test_every_map_is_a_study(installed_host):
    assert {f"stability-{name}" for name in MAPS} <= set(installed_host.names("study"))


@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in MAPS])
def test_no_safe_area_shrinks(name):
    found = areas_on(map_named(name), "check")
    shrunk = {method: (share, found[method]) for method, share in STORED[name].items() if found[method] < share - 1e-9}
    assert shrunk == {}, f"stored and measured safe share of the check grid of '{name}'"


def test_a_change_that_makes_a_map_worse_is_found(monkeypatch):
    from lsds_research.stability.maps import marker_travel

    # A tracker without its check for aliases takes the nearest marker for its own, as the naive one does.
    monkeypatch.setattr(marker_travel, "wrong_unflagged", lambda method, *rest: _wrong("blobs, nearest", *rest))
    found = areas_on(marker_travel.MAP, "check")
    assert any(found[method] < share for method, share in STORED["marker-travel"].items())


def _wrong(*arguments):
    from lsds_research.stability.maps.moved_markers import wrong_unflagged

    return wrong_unflagged(*arguments)


LIFTED = ["loop-delay", "frame-rate", "frame-jitter", "false-alarms", "friction-ticks"]
LIFTED += ["spheres", "camera", "image", "edge", "texture"]


@pytest.mark.parametrize("name", LIFTED)
def test_every_point_of_a_full_map_is_a_valid_config(monkeypatch, installed_host, name):
    """The column of 120 ms of `frame-rate` asked for more jitter than the sensor's option allowed."""
    asked = []

    def loaded(what):
        asked.append(load_config(None, what.overrides(), host=installed_host))
        return {"held": True, "slip_mm": 0.0, "peak_over_needed": 1.0, "late_reversals": 0}

    monkeypatch.setattr("lsds_research.stability.maps.lifts.lift", loaded)
    of = replace(map_named(name), seeds={"full": 1})
    for point in of.points("full", 0):
        of.measure(point.method, point.x, point.y, point.seed)
    assert len(asked) == len(of.points("full", 0))


def test_fingers_that_oscillate_until_the_end_of_a_hold_do_not_pass(monkeypatch):
    found = {"held": True, "peak_over_needed": 1.2, "late_reversals": 1}
    monkeypatch.setattr("lsds_research.stability.maps.friction_ticks.lifted", lambda *given: found)
    of = map_named("friction-ticks")
    assert of.measure("pd", 1.0, 0.2, 0) == 1.2
    found["late_reversals"] = 2
    assert of.measure("pd", 1.0, 0.2, 0) == math.inf
