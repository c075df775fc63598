"""`lsds.simulate`: many runs from one or two processes, the same results, and a reason for each that cannot run."""

from __future__ import annotations

import math
import os
import re

import numpy as np
import pytest

import lsds
from lsds.errors import DataError

REAL = (
    *("job.backend=watch", "sensor.backend=gelsight-mini", "gripper.backend=hand-e", "gripper.hand-e.port=/dev/null"),
    *("arm.backend=none", "cell.backend=none"),
)
QUICK = ("cell.simulated.fidelity=winkler", "task.lift_s=0.3", "task.hold_s=0.2")


def by_number(results):
    return {result.number: result for result in results}


def process_and_peak(session):
    return os.getpid(), session.summary["peak_normal_force_n"]


def dies(session):
    os.abort()


def comparable(summary):
    """The figures of a run without those of the machine."""
    return {key: summary[key] for key in ("outcome", "slip_distance_m", "peak_normal_force_n", "cycles", "verdict")}


def test_two_processes_give_the_results_of_one_and_of_run():
    scenarios = [[*QUICK, f"seed={seed}"] for seed in range(3)]
    one = by_number(lsds.simulate(scenarios))
    two = by_number(lsds.simulate(scenarios, jobs=2, figures=process_and_peak, truths=True))
    assert set(one) == set(two) == {0, 1, 2}
    for number, scenario in enumerate(scenarios):
        session = lsds.run(overrides=scenario)
        for result in (one[number], two[number]):
            assert comparable(result.summary) == comparable(session.summary)
            assert result.verdict == session.verdict
        assert two[number].truths == tuple(session.truths)
        assert two[number].figures[1] == session.summary["peak_normal_force_n"]
        assert two[number].figures[0] != os.getpid()
        assert one[number].truths == ()


def test_scenarios_are_configs_files_mappings_and_texts(tmp_path):
    file = tmp_path / "rig.toml"
    file.write_text('[cell.simulated]\nfidelity = "winkler"\n[task]\nlift_s = 0.3\nhold_s = 0.2\n')
    keys = {"cell.simulated.fidelity": "winkler", "task.lift_s": 0.3, "task.hold_s": 0.2}
    results = list(lsds.simulate([file, str(file), keys, QUICK, lsds.load_config(file)]))
    assert [result.number for result in results] == [0, 1, 2, 3, 4]
    assert len({str(comparable(result.summary)) for result in results}) == 1
    assert repr(results[0]).startswith("SimulatedRun(0: held: with ")


@pytest.mark.parametrize(
    ("scenario", "error"),
    [
        (["task.lift=1"], "ConfigError: .*task.lift"),
        (REAL, "real: .*hand-e"),
        ("nowhere.toml", "nowhere.toml"),
        ({"tactile.budget_ms": None}, "tactile.budget_ms = None: TOML cannot hold a NoneType"),
    ],
)
def test_a_scenario_that_cannot_run_has_an_error_and_the_others_run(scenario, error):
    first, second = lsds.simulate([scenario, QUICK])
    assert re.search(error, first.error, re.DOTALL), first.error
    assert (first.verdict, first.summary) == (None, {})
    assert second.error == ""
    assert second.verdict.in_grip


def test_a_config_with_a_real_device_is_refused():
    (result,) = lsds.simulate([lsds.load_config(None, REAL)])
    assert re.search("real: .*hand-e", result.error), result.error


@pytest.mark.slow
def no_figure(session):
    raise KeyError("peak")


@pytest.mark.parametrize("jobs", [1, 2])
def test_figures_that_raise_are_an_error_of_their_scenario(jobs):
    results = by_number(lsds.simulate([QUICK, (*QUICK, "seed=3")], jobs=jobs, figures=no_figure))
    for result in results.values():
        assert result.error == "no_figure raised KeyError: 'peak'"
        assert result.verdict.outcome == "held"


def test_figures_that_cannot_be_sent_are_refused_before_anything_runs():
    with pytest.raises(DataError, match=r"cannot be sent to other processes .* give a function of a module"):
        lsds.simulate([QUICK], jobs=2, figures=lambda session: 1)


def test_a_process_that_dies_costs_its_own_scenario_only():
    results = by_number(lsds.simulate([QUICK, ["task.lift=1"]], jobs=2, figures=dies))
    assert results[0].error == "its process died (a library's crash, or out of memory)"
    assert results[1].error.startswith("ConfigError")


@pytest.mark.parametrize("wrong", [3, [1, 2], None])
def test_what_is_no_scenario_is_named(wrong):
    with pytest.raises(DataError, match="is no scenario"):
        lsds.simulate([wrong])
    with pytest.raises(DataError, match="is no list of scenarios"):
        lsds.simulate(wrong if isinstance(wrong, int | None) else 3)
    with pytest.raises(DataError, match="must be a function of a run's session"):
        lsds.simulate([], figures=4)


@pytest.mark.parametrize("jobs", [0, "2", None, 1.5, math.nan, True, np.array([1, 2])])
def test_a_number_of_processes_that_is_none_is_named(jobs):
    with pytest.raises(DataError, match=rf"jobs = {re.escape(repr(jobs))}: must be a whole number from 1 on"):
        lsds.simulate([], jobs=jobs)


@pytest.mark.parametrize("one", ["task.lift_s=1", {"task.lift_s": 1.0}])
def test_one_scenario_instead_of_a_list_is_named(one):
    with pytest.raises(DataError, match="is one scenario: give a list"):
        lsds.simulate(one)


class Peak(Exception):
    """Needs two arguments, and pickle has one when it reads it."""

    def __init__(self, value, unit):
        super().__init__(f"{value} {unit}")


def unreadable(session):
    return Peak(1.0, "N")


def test_a_result_that_cannot_be_received_is_an_error_of_its_scenario():
    (result,) = lsds.simulate([QUICK], jobs=2, figures=unreadable)
    assert result.error.startswith("the result of unreadable, of type Peak, cannot be received by other processes")
    assert result.verdict.outcome == "held"


def unsendable(session):
    return lambda: session


def test_a_result_that_cannot_be_sent_is_an_error_of_its_scenario():
    results = by_number(lsds.simulate([QUICK, ["task.lift=1"]], jobs=2, figures=unsendable))
    assert results[0].error.startswith("the result of unsendable, of type function, cannot be sent to other processes")
    assert results[0].verdict.outcome == "held"
    assert results[1].error.startswith("ConfigError")
