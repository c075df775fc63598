"""`lsds study search`: the space, the search, the shrinking, and failures that were planted for it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.objects.catalogue import CATALOGUE
from lsds_research.search.fixed_keys import held_fixed
from lsds_research.search.objects import OBJECTS, completed
from lsds_research.search.plot import _short
from lsds_research.search.risk_options import RiskOptions
from lsds_research.search.robustness import STOPPED_MARGIN, Limits, hangs, margins_of, run_scenario, run_warnings
from lsds_research.search.seek import seek
from lsds_research.search.shrink import shrunk
from lsds_research.search.space import DEFAULT, Axis, point_to_scenario, read_space

from lsds.cli.main import main
from lsds.clock import VirtualClock
from lsds.config import load_config
from lsds.contracts import BuildContext
from lsds.errors import CallHangs, DataError
from lsds.session.run import Session, run
from lsds.session.verdict import Outcome, Verdict


def searched(margin, dimensions=4, runs=120, seed=0):
    found, batches = [], seek(dimensions, runs, seed)
    batch = next(batches)
    while True:
        margins = [margin(point) for point in batch]
        found += zip(margins, batch, strict=True)
        try:
            batch = batches.send(margins)
        except StopIteration:
            return found


def test_a_failure_in_a_small_corner_is_found_within_the_runs_that_were_asked_for():
    """A ball of 4 % of the cube fails; the margin is the distance to it."""
    centre = np.array([0.8, 0.2, 0.7, 0.3])
    found = searched(lambda point: float(np.linalg.norm(point - centre)) - 0.12)
    assert len(found) == 120
    assert min(margin for margin, _ in found) < 0
    assert all(np.all((point >= 0) & (point <= 1)) for _, point in found)


def test_the_search_depends_on_its_seed_and_on_nothing_else():
    first, again, other = (searched(lambda point: float(point.sum()), seed=seed) for seed in (1, 1, 2))
    assert [m for m, _ in first] == [m for m, _ in again]
    assert [m for m, _ in first] != [m for m, _ in other]


def test_a_failure_is_shrunk_to_the_keys_that_matter():
    scenario = point_to_scenario(DEFAULT, np.full(len(DEFAULT), 0.9))
    asked = []

    def fails(fewer):
        asked.append(fewer)
        return {"task.lift_speed_m_s", "gripper.mock-hand-e.latency_ms"} <= fewer.keys()

    small = shrunk(scenario, DEFAULT, fails)
    assert small.keys() == {"task.lift_speed_m_s", "gripper.mock-hand-e.latency_ms"}
    assert len(asked) < 64


def test_a_key_with_its_usual_value_may_matter():
    space = [Axis("a", 0.0, 1.0, usual=0.5), Axis("b", 0.0, 1.0, usual=0.5), Axis("c", 0.0, 1.0, usual=0.5)]
    scenario = {"a": 0.5, "b": 0.5, "c": 0.9}
    assert shrunk(scenario, space, lambda fewer: {"a", "c"} <= fewer.keys()) == {"a": 0.5, "c": 0.9}
    assert shrunk(scenario, space, lambda fewer: "c" in fewer) == {"c": 0.9}
    assert shrunk(scenario, space, lambda fewer: True, most=0) == scenario


def test_a_run_that_hangs_has_failed_whatever_it_took():
    verdict = Verdict(Outcome.STOPPED, "arm 'x' hangs", CallHangs.exit_code)
    fault = CallHangs("arm 'x'", "read", 5.0)
    margins = margins_of(Session({"outcome": "fault"}, None, (), None, None, fault, None, verdict))
    assert margins == {"named": STOPPED_MARGIN}
    assert hangs(CallHangs("arm 'x'", "read", 5.0))
    assert not hangs(None)
    assert run_scenario(({}, Limits(), ("task.lift_s=0.3", "task.hold_s=0.1")))["margins"]["ends"] == 1.0


def test_every_scenario_of_the_default_space_is_a_config():
    rng = np.random.default_rng(0)
    for point in [np.zeros(len(DEFAULT)), np.ones(len(DEFAULT)), *rng.random((6, len(DEFAULT)))]:
        load_config(None, [f"{key}={json.dumps(value)}" for key, value in point_to_scenario(DEFAULT, point).items()])
    assert Axis("x", 0.01, 1.0).value(0.5) == pytest.approx(0.1)
    assert Axis("x", 1, 3, whole=True).value(0.99) == 3


def test_a_space_of_ones_own_is_read_and_its_mistakes_are_named(tmp_path):
    file = tmp_path / "space.toml"
    file.write_text('[task]\nlift_speed_m_s = [0.02, 0.2]\n[cell.simulated]\nobject = ["ball", "book", "can"]\n')
    speed, thing = read_space(file)
    assert (speed.low, speed.high, speed.usual) == (0.02, 0.2, 0.038)
    assert thing.choices == ("ball", "book", "can")
    wrong = {
        "seed = 7": "is no range",
        "seed = [7, 3]": "is not below",
        "seed = [0.01, inf]": "is no number up to 1e\\+15",
        "seed = [nan, 1.0]": "is no number up to 1e\\+15",
        f"seed = [0, 1{400 * '0'}]": "is no number up to 1e\\+15",
        "": "no key with a range",
    }
    for text, message in wrong.items():
        file.write_text(text)
        with pytest.raises(DataError, match=message):
            read_space(file)


def test_a_key_that_the_settings_hold_fixed_is_not_drawn():
    """Settings count above drawn values: three speeds were drawn, reported, and run at the one of the rig."""
    space, fixed = held_fixed(DEFAULT, ["task.lift_speed_m_s=0.02", "seed=3", "task.hold_s=0.5"])
    assert sorted(fixed) == ["seed", "task.lift_speed_m_s"]
    rng = np.random.default_rng(1)
    drawn = [point_to_scenario(space, rng.random(len(space))) for _ in range(3)]
    assert {(one["task.lift_speed_m_s"], one["seed"]) for one in drawn} == {(0.02, 3)}
    assert len({one["cell.simulated.modulus_mpa"] for one in drawn}) == 3


def test_the_name_of_an_object_fixes_its_properties():
    """They were drawn over it: an owner of cans got the certificate of all objects."""
    space, fixed = held_fixed(OBJECTS, ["cell.simulated.object=can", "cell.simulated.mass_kg=0.5"])
    rng = np.random.default_rng(1)
    drawn = [completed(point_to_scenario(space, rng.random(len(space)))) for _ in range(3)]
    can = CATALOGUE["can"]
    for one in drawn:
        assert one["cell.simulated.shape"] == can.shape
        assert one["cell.simulated.diameter_mm"] == can.diameter_mm
        assert one["cell.simulated.mass_kg"] == 0.5
        assert one["cell.simulated.kinetic_friction"] == pytest.approx(can.kinetic_friction, abs=1e-3)
    assert "cell.simulated.length_mm" in fixed
    assert len({one["task.first_squeeze_m"] for one in drawn}) == 3
    own = (Axis("cell.simulated.mass_kg", 0.1, 0.6),)
    assert held_fixed(own, ["cell.simulated.object=can"]) == (own, [])
    # A space of objects by name draws other keys as well.
    assert held_fixed(DEFAULT, ["cell.simulated.object=can"])[1] == ["cell.simulated.object"]


def test_a_table_in_the_settings_counts_key_by_key():
    """As a whole it replaced the drawn keys, and escaped the rules for single keys."""
    options = RiskOptions(settings=['cell.simulated={fidelity="winkler",mass_kg=0.1}', "seed=3", "faults=[]"])
    assert options.settings == [
        'cell.simulated.fidelity="winkler"',
        "cell.simulated.mass_kg=0.1",
        "seed=3",
        "faults=[]",
    ]


def test_a_search_that_meets_scenarios_that_cannot_run_ends_with_a_warning():
    """It goes where scenarios fail, so they may be many, and its results were lost."""
    stuck = {"margins": {"named": 0.1}, "outcome": "not run", "fault": "no such object"}
    with pytest.raises(DataError, match="2 of 3 scenarios could not run"):
        run_warnings([stuck, stuck, {"margins": {"holds": 1.0}, "outcome": "held"}])
    (warning,) = run_warnings([stuck, stuck, {"margins": {"holds": 1.0}, "outcome": "held"}], most=1.0)
    assert warning.endswith("the first: no such object")


@pytest.mark.parametrize("command", [["risk", "--plain"], ["search"], ["certify"]])
def test_a_job_that_is_no_lift_is_refused(command, capsys):
    """Holding until another program releases it never ended, and a release on purpose counted as a drop."""
    assert main(["study", *command, "--runs", "20", "--with", "job.backend=hold", "--no-plot"]) == 2
    assert "'hold' is no lift" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["risk", "--plain", "--runs", "20"], ["search", "--quick"]])
def test_a_mistake_in_the_settings_is_found_before_the_first_run(command, capsys):
    """Runs that could not begin counted as held: the probability of a failure was below 2 %, with exit code 0."""
    assert main(["study", *command, "--with", "task.lift_sped_m_s=1", "--no-plot"]) == 2
    assert "lift_sped_m_s" in capsys.readouterr().err


def test_a_planted_failure_is_found_shrunk_and_saved_as_a_file_that_runs_again(tmp_path, capsys):
    """The sign as the paper prints it opens on slip, whatever else is the case."""
    space = tmp_path / "space.toml"
    space.write_text("[task]\nlift_speed_m_s = [0.03, 0.05]\nfirst_squeeze_m = [0.0008, 0.0012]\n")
    planted = ["--with", "controller.backend=pd", "--with", "controller.pd.literal_sign=true"]
    asked = ["study", "search", "--runs", "8", "--most", "1", "--space", str(space), "--found", str(tmp_path), *planted]
    out = ["--out", str(tmp_path / "kept.jsonl"), "--plot", str(tmp_path / "search.png")]
    assert main([*asked, *out, "--json", str(tmp_path / "search.json")]) == 0
    result = json.loads((tmp_path / "search.json").read_text())
    (found,) = result["found"]
    assert found["keys"] == "none: the default"
    session = run(found["file"])
    assert session.summary["outcome"] == "dropped"
    again = run_scenario(({}, Limits(), ("controller.backend=pd", "controller.pd.literal_sign=true")))
    assert min(again["margins"].values()) == found["margin"] < 0
    # The same command takes what is kept, and says the same.
    assert main([*asked, *out, "--json", str(tmp_path / "again.json")]) == 0
    assert json.loads((tmp_path / "again.json").read_text()) == result


def test_keys_with_equal_ends_have_different_labels_in_the_picture():
    keys = ["gripper.mock-hand-e.latency_ms", "sensor.mock-gelsight-mini.latency_ms", "task.hold_s"]
    assert _short(keys) == ["mock-hand-e.latency_ms", "mock-gelsight-mini.latency_ms", "hold_s"]


def test_each_whole_number_of_a_range_is_drawn_alike():
    """Rounding gave both ends half of the share of the others."""
    evenly = (np.arange(12000) + 0.5) / 12000
    for axis in (Axis("seed", 10000, 10003, whole=True), Axis("sensor.mock-gelsight-mini.gel", 1, 4, whole=True)):
        drawn, counts = np.unique([axis.value(u) for u in evenly], return_counts=True)
        assert drawn.tolist() == list(range(int(axis.low), int(axis.high) + 1))
        assert counts.tolist() == [3000] * 4
    assert {Axis("seed", 0, 9, whole=True).value(u) for u in (0.0, 1.0)} == {0, 9}


@given(st.floats(1e-6, 1e6), st.floats(1e-5, 100.0), st.floats(0, 1))
def test_a_drawn_value_lies_in_its_range(low, share, u):
    axis = Axis("task.lift_speed_m_s", low, low * (1 + share))
    assert axis.low <= axis.value(u) <= axis.high


def test_a_narrow_range_is_drawn_with_enough_digits():
    axis = Axis("task.lift_speed_m_s", 0.012345, 0.012346)
    assert len({axis.value(u) for u in np.linspace(0, 1, 101)}) > 50


def test_one_key_with_two_ranges_is_named(tmp_path):
    file = tmp_path / "space.toml"
    file.write_text('"task.lift_speed_m_s" = [0.01, 0.02]\n[task]\nlift_speed_m_s = [0.05, 0.06]\n', encoding="utf-8")
    with pytest.raises(DataError, match=r"task\.lift_speed_m_s: has two ranges"):
        read_space(file)


def test_quick_keeps_the_runs_that_are_given():
    from lsds_research.search.options import SearchOptions
    from lsds_research.search.risk import RiskStudy
    from lsds_research.search.risk_options import RiskOptions
    from lsds_research.search.study import SearchStudy

    context = BuildContext(VirtualClock())
    assert [RiskStudy(RiskOptions(quick=True, **own), context)._runs for own in ({}, {"runs": 100})] == [20, 100]
    assert [SearchStudy(SearchOptions(quick=True, **own), context)._runs for own in ({}, {"runs": 96})] == [48, 96]


def test_a_failure_that_kills_its_process_does_not_kill_the_search(tmp_path):
    from lsds_research.search.study import _record

    from lsds.support.processes import spread

    ((_, problem),) = spread(_record, [(str(tmp_path / "missing.toml"), str(tmp_path / "x.mcap"))], 2)
    assert "missing.toml" in problem
