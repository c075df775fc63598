"""The search over random objects: its space, and that a failure counts only where a firm grip holds the object."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.cell.options import CellOptions
from lsds_research.search import scenarios
from lsds_research.search.objects import FIRM, OBJECTS, chosen_space, completed
from lsds_research.search.options import SearchOptions
from lsds_research.search.robustness import Limits
from lsds_research.search.scenarios import NOT_HOLDABLE, Scenarios, not_holdable
from lsds_research.search.space import DEFAULT, point_to_scenario
from lsds_research.search.study import SearchStudy

from lsds.cli.main import main
from lsds.clock import VirtualClock
from lsds.config import load_config
from lsds.config.overrides import override_texts
from lsds.contracts import BuildContext
from lsds.errors import DataError

MASS, FRICTION = "cell.simulated.mass_kg", "cell.simulated.static_friction"


@pytest.fixture
def lifts(monkeypatch):
    """Lifts that fail above 1 kg; a firm grip holds what has a friction above 0.5."""
    asked = []

    def lifted(lift):
        scenario, _, settings = lift
        asked.append((scenario, settings))
        is_firm = "controller.enabled=false" in settings
        holds = scenario[MASS] < 1 or (is_firm and scenario[FRICTION] > 0.5)
        return {"margins": {"holds": 1.0 if holds else -1.0}, "outcome": "held" if holds else "dropped", "fault": None}

    monkeypatch.setattr(scenarios, "run_scenario", lifted)
    return asked


def rows(file="", firm=FIRM):
    light, heavy, hopeless = {MASS: 0.5, FRICTION: 0.3}, {MASS: 1.5, FRICTION: 0.8}, {MASS: 1.5, FRICTION: 0.3}
    return Scenarios(Limits(), (), file, 1, "", firm).rows([light, heavy, hopeless], lambda done: None)


def test_what_no_firm_grip_holds_is_no_failure(lifts):
    light, heavy, hopeless = rows()
    assert (light["margin"], heavy["margin"]) == (1.0, -1.0)
    assert (hopeless["margin"], hopeless["outcome"]) == (1.0, NOT_HOLDABLE)
    assert not_holdable([light, heavy, hopeless]) == [
        "in 1 of 3 no firm grip holds the object either; they count as held"
    ]
    assert len(lifts) == 3 + 2 * len(FIRM)
    assert rows(firm=())[2]["margin"] == -1.0


def test_a_crash_is_a_failure_whatever_a_firm_grip_does(monkeypatch):
    crash = {"margins": {"named": -1.0}, "outcome": "not run", "fault": "ZeroDivisionError: by zero"}
    monkeypatch.setattr(scenarios, "run_scenario", lambda lift: crash)
    assert [row["margin"] for row in rows()] == [-1.0, -1.0, -1.0]


def test_a_firm_lift_that_does_not_end_excuses_nothing(monkeypatch):
    def lifted(lift):
        if "controller.enabled=false" in lift[2]:
            return {"margins": {"named": 0.1}, "outcome": "not run", "fault": "SafetyStop: no frames"}
        return {"margins": {"holds": -1.0}, "outcome": "dropped", "fault": None}

    monkeypatch.setattr(scenarios, "run_scenario", lifted)
    assert [row["margin"] for row in rows()] == [-1.0, -1.0, -1.0]


def test_the_answer_about_a_firm_grip_is_stored(lifts, tmp_path):
    file = str(tmp_path / "runs.jsonl")
    first = rows(file)
    count = len(lifts)
    assert rows(file) == first
    assert len(lifts) == count


def test_every_random_object_is_a_config():
    for point in np.random.default_rng(5).random((20, len(OBJECTS))):
        scenario = completed(point_to_scenario(OBJECTS, point))
        for firm in ((), *FIRM):
            load_config(None, [*override_texts(scenario), *firm])


@given(point=st.lists(st.floats(0, 1, exclude_max=True), min_size=len(OBJECTS), max_size=len(OBJECTS)), data=st.data())
def test_whatever_is_left_out_of_a_scenario_the_rest_describes_one_object(point, data):
    drawn = point_to_scenario(OBJECTS, point)
    kept = data.draw(st.sets(st.sampled_from(sorted(drawn))))
    scenario = completed({key: value for key, value in drawn.items() if key in kept})
    cell = {key.removeprefix("cell.simulated."): value for key, value in scenario.items() if "cell.simulated" in key}
    options = CellOptions(**cell)
    assert options.kinetic_friction <= options.static_friction
    if options.shape == "sphere":
        assert (options.length_mm, options.turned_deg) == (max(20.0, options.diameter_mm), 0.0)
    if "task.lift_speed_m_s" in scenario:
        assert scenario["task.lift_s"] * scenario["task.lift_speed_m_s"] <= 0.1201


def test_a_failure_is_shrunk_from_what_was_drawn(monkeypatch):
    """Heavy objects fail, and a sphere is as long as it is thick: the smallest scenario is the mass alone."""

    def lifted(lift):
        scenario, _, _ = lift
        shape, friction = scenario.get("cell.simulated.shape"), scenario.get(FRICTION, 1.0)
        assert shape != "sphere" or scenario["cell.simulated.length_mm"] >= scenario["cell.simulated.diameter_mm"]
        assert scenario.get("cell.simulated.kinetic_friction", 0.0) <= friction
        margin = 1.0 - scenario.get(MASS, 0.3)
        return {"margins": {"holds": margin}, "outcome": "lifted", "fault": None, "simulated_s": 1.0}

    monkeypatch.setattr(scenarios, "run_scenario", lifted)
    monkeypatch.setattr("lsds_research.search.objects.FIRM", ())
    options = SearchOptions(random=True, runs=32, jobs=1, most=1)
    found = SearchStudy(options, BuildContext(VirtualClock(), 0)).run(lambda done, of: None).rows
    assert [row["keys"].partition(" = ")[0] for row in found] == ["mass_kg"]


def test_a_space_is_one_of_three(tmp_path):
    file = tmp_path / "space.toml"
    file.write_text('"task.lift_s" = [1.0, 2.0]\n')
    assert chosen_space("", random=False).axes == DEFAULT
    assert chosen_space("", random=True) == (OBJECTS, FIRM, completed)
    assert [axis.key for axis in chosen_space(str(file), random=False).axes] == ["task.lift_s"]
    with pytest.raises(DataError, match="leave one out"):
        chosen_space(str(file), random=True)


@pytest.mark.slow
def test_search_and_risk_draw_random_objects(tmp_path):
    for study, more in (("search", ["--runs", "8", "--most", "0"]), ("risk", ["--plain", "--runs", "20"])):
        file = tmp_path / f"{study}.json"
        short = ["--with", "task.hold_s=0.1", "--jobs", "1"]
        assert main(["study", study, "--random", *more, *short, "--no-plot", "--json", str(file)]) == 0
        runs = json.loads(file.read_text())["runs"]
        assert {"cell.simulated.shape", "cell.simulated.mass_kg"} <= runs[0]["scenario"].keys()
        assert len({run["scenario"]["cell.simulated.shape"] for run in runs}) > 1
