"""Every mistake of a study or a command is found by its check, and honest ones pass all of them."""

from __future__ import annotations

import sys

import mutants_commands
import mutants_studies
import pytest
from catching import CAUGHT_COMMANDS, CAUGHT_STUDIES, require_caught
from fake_cell import plugin
from honest_study import HonestStudy, honest_command, honest_group

from lsds.contracts import BackendSpec
from lsds.registry import PluginHost
from lsds.testing import Bench, cases, run_checks
from lsds.testing.option_keys import OPTION_CHECKS


def study_bench(study):
    return bench(
        BackendSpec("study", study.__name__.lower(), f"{study.__module__}:{study.__name__}", "honest_study:Options")
    )


def command_bench(command, module=mutants_commands, summary="greet"):
    (attribute,) = [name for name, value in vars(module).items() if value is command]
    spec = BackendSpec("command", attribute.replace("_", "-"), f"{module.__name__}:{attribute}", summary=summary)
    return bench(spec)


def bench(spec):
    host = PluginHost(entry_points=[])
    host.register(plugin(spec), distribution="mutants", name="mutants")
    return Bench(spec.kind, spec.name, host=host)


def name_of(mutant):
    return getattr(mutant, "__name__", None) or mutant.name


HONEST_STUDY = cases(study_bench(HonestStudy))
HONEST_COMMANDS = [
    case
    for found in (honest_command, honest_group)
    for case in cases(command_bench(found, sys.modules["honest_study"]))
]


@pytest.mark.parametrize("case", [*HONEST_STUDY, *HONEST_COMMANDS], ids=lambda case: case.id)
def test_an_honest_one_passes(case):
    result = case.run()
    assert result.outcome == "passed", result


@pytest.mark.parametrize("mutant", CAUGHT_STUDIES, ids=name_of)
def test_a_study_is_caught_by_the_check_of_its_mistake(mutant):
    check, match = CAUGHT_STUDIES[mutant]
    require_caught(study_bench(mutant), check, match, "docs/plugins.md#studies")


@pytest.mark.parametrize("mutant", CAUGHT_COMMANDS, ids=name_of)
def test_a_command_is_caught_by_the_check_of_its_mistake(mutant):
    check, match = CAUGHT_COMMANDS[mutant]
    require_caught(command_bench(mutant), check, match, "docs/plugins.md#commands")


def test_mutants_are_registered():
    assert {mutant.__module__ for mutant in CAUGHT_STUDIES} == {mutants_studies.__name__}
    assert len(CAUGHT_STUDIES) > 20
    assert len(CAUGHT_COMMANDS) > 10


def test_every_check_catches_a_mutant():
    assert {case.check for case in HONEST_STUDY} - {*OPTION_CHECKS} == {check for check, _ in CAUGHT_STUDIES.values()}
    assert {case.check for case in HONEST_COMMANDS} - {*OPTION_CHECKS} == {
        check for check, _ in CAUGHT_COMMANDS.values()
    }


def test_a_backend_without_a_summary_is_caught():
    (result,) = run_checks(command_bench(honest_command, sys.modules["honest_study"], summary=""), ["has_a_summary"])
    assert "the backend's summary is ''" in result.message


def test_a_study_runs_once_for_all_checks_but_that_of_the_seed(monkeypatch):
    runs = []
    original = HonestStudy.run
    monkeypatch.setattr(HonestStudy, "run", lambda self, tick: (runs.append(1), original(self, tick))[1])
    results = run_checks(study_bench(HonestStudy))
    assert {result.outcome for result in results} == {"passed"}
    assert len(runs) == 2


def test_a_further_part_of_a_study_may_begin_again(monkeypatch):
    monkeypatch.setattr(mutants_studies.StopsOneShort, "ticks", lambda self: [(1, 2), (2, 2), (0, 5), (5, 5)])
    (result,) = run_checks(study_bench(mutants_studies.StopsOneShort), ["progress_reaches_its_end"])
    assert result.outcome == "passed", result


def test_checks_of_a_picture_and_of_a_seed_do_not_apply_without_one(monkeypatch):
    monkeypatch.setattr(HonestStudy, "draw", None)
    spec = BackendSpec("study", "plain", "test_mutants_of_studies:unseeded")
    results = run_checks(bench(spec), ["draws_a_png", "same_seed_same_rows"])
    assert [result.outcome for result in results] == ["not applicable", "not applicable"]


def unseeded(options, context):
    return HonestStudy(type("Fixed", (), {"throws": 2, "seed": 0}), context)
