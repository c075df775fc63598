"""Every mistake is found by the check that is about it, with a remedy, and an honest algorithm passes all of them."""

from __future__ import annotations

import mutants_detectors
import mutants_estimators
import mutants_tasks
import mutants_trackers
import pytest
from catching import CAUGHT
from fake_cell import plugin
from honest import HonestController, HonestDetector, HonestEstimator, HonestJob, HonestTracker

from lsds.contracts import BackendSpec
from lsds.plugins import PluginHost
from lsds.testing import Bench, cases

MODULES = (mutants_detectors, mutants_estimators, mutants_trackers, mutants_tasks)
HONEST = {
    "detector": HonestDetector,
    "estimator": HonestEstimator,
    "tracker": HonestTracker,
    "controller": HonestController,
    "job": HonestJob,
}


def bench(kind, algorithm):
    host = PluginHost(entry_points=[])
    spec = BackendSpec(kind, algorithm.__name__.lower(), f"{algorithm.__module__}:{algorithm.__name__}")
    host.register(plugin(spec), distribution="mutants", name="mutants")
    return Bench(kind, spec.name, host=host)


HONEST_CASES = [case for kind, algorithm in HONEST.items() for case in cases(bench(kind, algorithm))]


@pytest.mark.parametrize("case", HONEST_CASES, ids=lambda case: case.id)
def test_an_honest_algorithm_passes(case):
    case()


@pytest.mark.parametrize("mutant", CAUGHT, ids=lambda mutant: mutant.__name__)
def test_a_mutant_is_caught_by_the_check_of_its_mistake(mutant):
    kind, check, match = CAUGHT[mutant]
    found = bench(kind, mutant)
    assert check in [case.check for case in cases(found)]
    with pytest.raises(AssertionError, match=match) as caught:
        check(found)
    remedies = ("; ", "(or abstain")
    assert any(remedy in str(caught.value) for remedy in remedies), f"no remedy in: {caught.value}"


def test_mutants_are_registered():
    assert {mutant.__module__ for mutant in CAUGHT} == {module.__name__ for module in MODULES}
    assert len(CAUGHT) > 60


def test_every_check_catches_a_mutant():
    checks = {case.check for case in HONEST_CASES}
    assert {check.__name__ for check in checks} == {check.__name__ for _, check, _ in CAUGHT.values()}
